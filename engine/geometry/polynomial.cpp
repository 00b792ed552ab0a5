// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/polynomial.h"

#include <cstddef>

namespace docent::engine {
namespace {

// Zero of a polynomial between two arguments at which its signs differ, by bisection to machine precision.
double Bisect(const std::vector<double>& coefficients, double low, double high) {
  const bool low_is_positive = EvaluatePolynomial(coefficients, low) > 0;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) {
      break;
    }
    ((EvaluatePolynomial(coefficients, middle) > 0) == low_is_positive ? low : high) = middle;
  }
  return low;
}

}  // namespace

double EvaluatePolynomial(const std::vector<double>& coefficients, double x) {
  double value = 0;
  for (std::size_t i = coefficients.size(); i-- > 0;) {
    value = value * x + coefficients[i];
  }
  return value;
}

// Between two neighbouring extrema there is at most one zero, and the extrema are the derivative's sign
// changes.
std::vector<double> SignChanges(const std::vector<double>& coefficients, double limit) {
  if (coefficients.size() < 2) {
    return {};
  }
  std::vector<double> derivative;
  for (std::size_t i = 1; i < coefficients.size(); ++i) {
    derivative.push_back(static_cast<double>(i) * coefficients[i]);
  }
  std::vector<double> ends = SignChanges(derivative, limit);
  ends.push_back(limit);
  std::vector<double> result;
  double low = 0;
  for (const double high : ends) {
    if ((EvaluatePolynomial(coefficients, low) > 0) != (EvaluatePolynomial(coefficients, high) > 0)) {
      result.push_back(Bisect(coefficients, low, high));
    }
    low = high;
  }
  return result;
}

}  // namespace docent::engine
