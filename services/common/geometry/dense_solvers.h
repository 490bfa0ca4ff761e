// Eigen's decompositions, compiled once: each costs a source that names it some seconds. No memory is
// allocated for matrices of up to 6 x 6.
#pragma once

#include <Eigen/Core>

namespace forgescan {

using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

struct Eigensystem {
  SmallVector values;   // ascending
  SmallMatrix vectors;  // columns, unit length
};

// Of a symmetric matrix.
Eigensystem EigensystemOf(const SmallMatrix& symmetric);
SmallVector EigenvaluesOf(const SmallMatrix& symmetric);

// By LU with partial pivoting; not finite if the matrix is singular.
SmallMatrix InverseOf(const SmallMatrix& matrix);

// x of matrix x = right_side, by LDLT. The matrix is symmetric and not negative.
SmallVector SolvePositive(const SmallMatrix& matrix, const SmallVector& right_side);

// The solution of least squares and least norm, by a complete orthogonal decomposition: pivots below
// `threshold` times the largest count as 0.
Eigen::VectorXd LeastNormSolution(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right_side,
                                  double threshold);
struct PseudoInverse {
  Eigen::MatrixXd matrix;
  Eigen::Index rank;
};
PseudoInverse PseudoInverseOf(const Eigen::MatrixXd& matrix, double threshold);

}  // namespace forgescan
