// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

// Real polynomials with few coefficients, constant term first. For initialization code, not for inner loops.
namespace docent::engine {

double EvaluatePolynomial(const std::vector<double>& coefficients, double x);

// All arguments in (0, limit) where the polynomial changes its sign, ascending, to machine precision. Zeros
// without a sign change are not included.
std::vector<double> SignChanges(const std::vector<double>& coefficients, double limit);

}  // namespace docent::engine
