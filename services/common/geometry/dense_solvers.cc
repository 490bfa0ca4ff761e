#include "services/common/geometry/dense_solvers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace forgescan {
namespace {

using EigenSolver = Eigen::SelfAdjointEigenSolver<SmallMatrix>;

Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> Decompose(const Eigen::MatrixXd& matrix,
                                                                  double threshold) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(threshold);
  solver.compute(matrix);
  return solver;
}

}  // namespace

Eigensystem EigensystemOf(const SmallMatrix& symmetric) {
  const EigenSolver solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SmallVector EigenvaluesOf(const SmallMatrix& symmetric) {
  return EigenSolver(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
}

SmallMatrix InverseOf(const SmallMatrix& matrix) { return matrix.inverse(); }

SmallVector SolvePositive(const SmallMatrix& matrix, const SmallVector& right_side) {
  return matrix.ldlt().solve(right_side);
}

Eigen::VectorXd LeastNormSolution(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right_side,
                                  double threshold) {
  return Decompose(matrix, threshold).solve(right_side);
}

PseudoInverse PseudoInverseOf(const Eigen::MatrixXd& matrix, double threshold) {
  const auto solver = Decompose(matrix, threshold);
  return {solver.pseudoInverse(), solver.rank()};
}

}  // namespace forgescan
