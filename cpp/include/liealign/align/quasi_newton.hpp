// Minimum of a cost of a few parameters whose derivatives nobody has written down: BFGS on central differences.
//
// A round evaluates x and x +- h e_i as one batch: the gradient, and the diagonal of the Hessian for free. The Hessian is that
// diagonal at first, later BFGS's with its rows and columns scaled to it. A step is never longer than `longest` in any
// parameter, and is taken only where the cost falls. Source: Nocedal & Wright (2006) ch. 6, 8.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace liealign {

// The costs of some points, in their order; infinity where there is none.
using BatchCost = std::function<std::vector<double>(const std::vector<Eigen::VectorXd>&)>;

struct QuasiNewtonOptions {
  double difference = 0.1;  // h
  double tolerance = 0.05;  // of the fall that one more step promises
  double longest = 1.5;
  int max_rounds = 12;
};

struct QuasiNewtonResult {
  Eigen::VectorXd x;
  double cost = 0.0;
  Eigen::MatrixXd hessian;
  bool settled = false;
  int evaluations = 0;
};

QuasiNewtonResult minimise(const BatchCost& cost, const Eigen::VectorXd& start, const QuasiNewtonOptions& options = {});

}  // namespace liealign
