// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

// Real polynomials of a few coefficients, constant term first. For set-up, not for inner loops.
namespace docent::engine {

double EvaluatePolynomial(const std::vector<double>& coefficients, double x);

// All arguments in (0, limit) where the polynomial changes its sign, ascending, to the last digit. A zero
// that it only touches is not among them.
std::vector<double> SignChanges(const std::vector<double>& coefficients, double limit);

}  // namespace docent::engine
