// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/five_point.h"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace docent::engine {
namespace {

// Polynomials in (x, y, z). The monomials are in the order that the elimination needs, highest degree first:
//   cubic      x3 x2y x2z xy2 xyz xz2 y3 y2z yz2 z3 | then quadratic's
//   quadratic  x2 xy xz y2 yz z2 | then linear's
//   linear     x y z 1
using Linear = Eigen::Matrix<double, 1, 4>;
using Quadratic = Eigen::Matrix<double, 1, 10>;
using Cubic = Eigen::Matrix<double, 1, 20>;

// kLinearTimesLinear[i][j] is the index of (i-th linear) * (j-th linear) among the quadratic monomials.
constexpr int kLinearTimesLinear[4][4] = {{0, 1, 2, 6}, {1, 3, 4, 7}, {2, 4, 5, 8}, {6, 7, 8, 9}};
// kQuadraticTimesLinear[i][j] is the same for (i-th quadratic) * (j-th linear) among the cubic monomials.
constexpr int kQuadraticTimesLinear[10][4] = {
    {0, 1, 2, 10}, {1, 3, 4, 11},    {2, 4, 5, 12},    {3, 6, 7, 13},    {4, 7, 8, 14},
    {5, 8, 9, 15}, {10, 11, 12, 16}, {11, 13, 14, 17}, {12, 14, 15, 18}, {16, 17, 18, 19}};

Quadratic Multiply(const Linear& a, const Linear& b) {
  Quadratic product = Quadratic::Zero();
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) product[kLinearTimesLinear[i][j]] += a[i] * b[j];
  return product;
}

void AddProduct(const Quadratic& a, const Linear& b, double sign, Cubic* sum) {
  for (int i = 0; i < 10; ++i)
    for (int j = 0; j < 4; ++j) (*sum)[kQuadraticTimesLinear[i][j]] += sign * a[i] * b[j];
}

// The ten cubic constraints on E = x E0 + y E1 + z E2 + E3: det E = 0 and 2 E E'E - trace(E E') E = 0.
Eigen::Matrix<double, 10, 20> MakeConstraints(const Eigen::Matrix<double, 9, 4>& basis) {
  const auto entry = [&](int row, int column) -> Linear { return basis.row(3 * row + column); };
  Eigen::Matrix<double, 10, 20> constraints;

  Cubic determinant = Cubic::Zero();
  for (int column = 0; column < 3; ++column) {
    const int next = (column + 1) % 3, last = (column + 2) % 3;
    const Quadratic minor =
        Multiply(entry(1, next), entry(2, last)) - Multiply(entry(1, last), entry(2, next));
    AddProduct(minor, entry(0, column), 1.0, &determinant);
  }
  constraints.row(0) = determinant;

  std::array<std::array<Quadratic, 3>, 3> products;  // E E'
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      products[i][j] = Multiply(entry(i, 0), entry(j, 0)) + Multiply(entry(i, 1), entry(j, 1)) +
                       Multiply(entry(i, 2), entry(j, 2));
      products[j][i] = products[i][j];
    }
  }
  const Quadratic half_trace = 0.5 * (products[0][0] + products[1][1] + products[2][2]);
  for (int i = 0; i < 3; ++i) products[i][i] -= half_trace;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      Cubic sum = Cubic::Zero();
      for (int k = 0; k < 3; ++k) AddProduct(products[i][k], entry(k, j), 1.0, &sum);
      constraints.row(1 + 3 * i + j) = sum;
    }
  }
  return constraints;
}

}  // namespace

std::vector<Eigen::Matrix3d> SolveFivePoint(std::span<const Eigen::Vector3d, 5> rays_in_a,
                                            std::span<const Eigen::Vector3d, 5> rays_in_b) {
  // Each column holds one pair's coefficients of the entries of E, row by row.
  Eigen::Matrix<double, 9, 5> coefficients;
  for (int i = 0; i < 5; ++i)
    for (int row = 0; row < 3; ++row)
      coefficients.block<3, 1>(3 * row, i) =
          rays_in_b[static_cast<std::size_t>(i)][row] * rays_in_a[static_cast<std::size_t>(i)];
  const Eigen::HouseholderQR<Eigen::Matrix<double, 9, 5>> qr(coefficients);
  const Eigen::Matrix<double, 9, 9> q = qr.householderQ();
  const Eigen::Matrix<double, 9, 4> basis = q.rightCols<4>();

  const Eigen::Matrix<double, 10, 20> constraints = MakeConstraints(basis);
  const Eigen::PartialPivLU<Eigen::Matrix<double, 10, 10>> lu(constraints.leftCols<10>());
  const Eigen::Matrix<double, 10, 10> reduced = lu.solve(constraints.rightCols<10>());
  if (!reduced.allFinite()) return {};

  // Multiplication by x of the quotient ring's basis x2 xy xz y2 yz z2 x y z 1.
  Eigen::Matrix<double, 10, 10> action = Eigen::Matrix<double, 10, 10>::Zero();
  action.topRows<6>() = -reduced.topRows<6>();
  action(6, 0) = action(7, 1) = action(8, 2) = action(9, 6) = 1;

  const Eigen::EigenSolver<Eigen::Matrix<double, 10, 10>> eigen(action);
  if (eigen.info() != Eigen::Success) return {};
  std::vector<Eigen::Matrix3d> solutions;
  for (int i = 0; i < 10; ++i) {
    if (eigen.eigenvalues()[i].imag() != 0) continue;
    // A real eigenvalue's column of the pseudo-eigenvectors is its (real) eigenvector.
    const Eigen::Matrix<double, 10, 1> vector = eigen.pseudoEigenvectors().col(i);
    Eigen::Matrix<double, 9, 1> entries = basis * vector.tail<4>();
    const double norm = entries.norm();
    if (!(norm > 1e-12)) continue;
    entries /= norm;
    solutions.push_back(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(entries.data()));
  }
  return solutions;
}

Eigen::Matrix3d EssentialFromPose(const Rigid3& b_from_a) {
  return Hat(b_from_a.translation) * b_from_a.rotation.matrix();
}

std::array<Rigid3, 4> PosesFromEssential(const Eigen::Matrix3d& essential) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
  if (u.determinant() < 0) u.col(2) *= -1;
  if (v.determinant() < 0) v.col(2) *= -1;
  Eigen::Matrix3d quarter_turn;
  quarter_turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Rotation3 first(Eigen::Matrix3d(u * quarter_turn * v.transpose()));
  const Rotation3 second(Eigen::Matrix3d(u * quarter_turn.transpose() * v.transpose()));
  const Eigen::Vector3d translation = u.col(2);
  return {Rigid3{first, translation}, Rigid3{first, -translation}, Rigid3{second, translation},
          Rigid3{second, -translation}};
}

}  // namespace docent::engine
