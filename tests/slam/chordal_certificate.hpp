#pragma once
#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace hm::test {

/// A pose graph in the cost of Rosen et al., "SE-Sync", IJRR 2019:
///   f = sum over edges of  kappa |R_j - R_i R_ij|_F^2 + tau |t_j - t_i - R_i t_ij|^2,  without a factor 1/2,
/// solved further from a good start, and its optimum certified: independent of Ceres and of pose_edge_error.
template <int kDim>
class ChordalGraph {
 public:
  using Rotation = Eigen::Matrix<double, kDim, kDim>;
  using Place = Eigen::Matrix<double, kDim, 1>;
  struct Node {
    Rotation R;
    Place t;
  };
  struct Edge {
    std::size_t from, to;
    Node motion;
    double kappa, tau;
  };
  std::vector<Node> nodes;
  std::vector<Edge> edges;

  [[nodiscard]] double cost() const {
    double sum = 0;
    for (const Edge& e : edges) {
      const Node &a = nodes[e.from], &b = nodes[e.to];
      sum += e.kappa * (b.R - a.R * e.motion.R).squaredNorm() +
             e.tau * (b.t - a.t - a.R * e.motion.t).squaredNorm();
    }
    return sum;
  }

  /// Gauss-Newton until nothing changes. The first node stays.
  void polish(int max_rounds) {
    for (int round = 0; round < max_rounds; ++round)
      if (step() < 1e-7) return;
  }

  /// A lower bound of the cost of every assignment of poses (weak duality). With M the cost's matrix over
  /// [translations; rotations] and L the block-diagonal symmetric part of M R^T R at these rotations,
  /// f(any) >= f(here) - epsilon * dimensions * nodes  when M - L + epsilon I (on the rotations) is positive
  /// definite, which Cholesky's success proves. Nothing when it fails.
  [[nodiscard]] std::optional<double> lower_bound(double epsilon) const {
    const Eigen::SparseMatrix<double> cost_matrix = matrix();
    Eigen::MatrixXd variables(cost_matrix.rows(),
                              kDim);  // rows: R^T of each node, then t^T of each but the first
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      variables.middleRows(rotation_row(i), kDim) = nodes[i].R.transpose();
      if (i > 0) variables.row(place_row(i)) = (nodes[i].t - nodes[0].t).transpose();
    }
    const Eigen::MatrixXd product = cost_matrix * variables;
    std::vector<Eigen::Triplet<double>> dual;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Rotation block = product.middleRows(rotation_row(i), kDim) * nodes[i].R;
      const Rotation multiplier = 0.5 * (block + block.transpose());
      for (int r = 0; r < kDim; ++r)
        for (int c = 0; c < kDim; ++c)
          dual.emplace_back(rotation_row(i) + r, rotation_row(i) + c,
                            (r == c ? epsilon : 0) - multiplier(r, c));
    }
    Eigen::SparseMatrix<double> shift(cost_matrix.rows(), cost_matrix.cols());
    shift.setFromTriplets(dual.begin(), dual.end());
    const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> cholesky(cost_matrix + shift);
    if (cholesky.info() != Eigen::Success) return std::nullopt;
    return cost() - epsilon * kDim * static_cast<double>(nodes.size());
  }

 private:
  static constexpr int kTurns = kDim * (kDim - 1) / 2, kMoves = kTurns + kDim;
  using Turn = Eigen::Matrix<double, kTurns, 1>;

  [[nodiscard]] Eigen::Index rotation_row(std::size_t node) const {
    return static_cast<Eigen::Index>(kDim * node);
  }
  [[nodiscard]] Eigen::Index place_row(std::size_t node) const {
    return static_cast<Eigen::Index>(kDim * nodes.size() + node - 1);
  }

  static Rotation generator(int turn) {
    Rotation g = Rotation::Zero();
    if constexpr (kDim == 2) {
      g << 0, -1, 1, 0;
    } else {
      g((turn + 2) % 3, (turn + 1) % 3) = 1;
      g((turn + 1) % 3, (turn + 2) % 3) = -1;
    }
    return g;
  }
  static Rotation nearest_rotation(const Rotation& m) {
    const Eigen::JacobiSVD<Rotation> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return svd.matrixU() * svd.matrixV().transpose();
  }

  /// f as variables^T M variables, with t of the first node 0.
  [[nodiscard]] Eigen::SparseMatrix<double> matrix() const {
    std::vector<Eigen::Triplet<double>> entries;
    const auto size = static_cast<Eigen::Index>((kDim + 1) * nodes.size() - 1);
    for (const Edge& e : edges) {
      // kappa |R_j^T - R_ij^T R_i^T|^2 and tau |t_j^T - t_i^T - t_ij^T R_i^T|^2, row by row.
      for (int r = 0; r < kDim; ++r) {
        std::vector<std::pair<Eigen::Index, double>> row{{rotation_row(e.to) + r, 1}};
        for (int c = 0; c < kDim; ++c) row.emplace_back(rotation_row(e.from) + c, -e.motion.R(c, r));
        add_square(row, e.kappa, entries);
      }
      std::vector<std::pair<Eigen::Index, double>> row;
      if (e.to > 0) row.emplace_back(place_row(e.to), 1);
      if (e.from > 0) row.emplace_back(place_row(e.from), -1);
      for (int c = 0; c < kDim; ++c) row.emplace_back(rotation_row(e.from) + c, -e.motion.t[c]);
      add_square(row, e.tau, entries);
    }
    Eigen::SparseMatrix<double> m(size, size);
    m.setFromTriplets(entries.begin(), entries.end());
    return m;
  }
  static void add_square(const std::vector<std::pair<Eigen::Index, double>>& row, double weight,
                         std::vector<Eigen::Triplet<double>>& entries) {
    for (const auto& [i, a] : row)
      for (const auto& [j, b] : row) entries.emplace_back(i, j, weight * a * b);
  }

  /// One Gauss-Newton step; the largest change.
  double step() {
    const auto size = static_cast<Eigen::Index>(kMoves * (nodes.size() - 1));
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
    constexpr int kRows = kDim * kDim + kDim;
    for (const Edge& e : edges) {
      const Node &a = nodes[e.from], &b = nodes[e.to];
      const double root_kappa = std::sqrt(e.kappa), root_tau = std::sqrt(e.tau);
      Eigen::Matrix<double, kRows, 1> residual;
      Eigen::Matrix<double, kRows, 2 * kMoves> jacobian = Eigen::Matrix<double, kRows, 2 * kMoves>::Zero();
      const Rotation apart = root_kappa * (b.R - a.R * e.motion.R);
      residual << Eigen::Map<const Eigen::Matrix<double, kDim * kDim, 1>>(apart.data()),
          root_tau * (b.t - a.t - a.R * e.motion.t);
      for (int turn = 0; turn < kTurns; ++turn) {
        const Rotation of_a = -root_kappa * a.R * generator(turn) * e.motion.R,
                       of_b = root_kappa * b.R * generator(turn);
        jacobian.template block<kDim * kDim, 1>(0, turn) =
            Eigen::Map<const Eigen::Matrix<double, kDim * kDim, 1>>(of_a.data());
        jacobian.template block<kDim * kDim, 1>(0, kMoves + turn) =
            Eigen::Map<const Eigen::Matrix<double, kDim * kDim, 1>>(of_b.data());
        jacobian.template block<kDim, 1>(kDim * kDim, turn) = -root_tau * a.R * generator(turn) * e.motion.t;
      }
      jacobian.template block<kDim, kDim>(kDim * kDim, kTurns) = -root_tau * Rotation::Identity();
      jacobian.template block<kDim, kDim>(kDim * kDim, kMoves + kTurns) = root_tau * Rotation::Identity();
      add_normal(e, jacobian.transpose() * jacobian, jacobian.transpose() * residual, entries, gradient);
    }
    Eigen::SparseMatrix<double> normal(size, size);
    normal.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> cholesky(normal);
    const Eigen::VectorXd move = cholesky.solve(-gradient);
    for (std::size_t i = 1; i < nodes.size(); ++i) {
      const auto first = static_cast<Eigen::Index>(kMoves * (i - 1));
      Rotation turned = Rotation::Identity();
      for (int turn = 0; turn < kTurns; ++turn) turned += move[first + turn] * generator(turn);
      nodes[i].R = nodes[i].R * nearest_rotation(turned);
      nodes[i].t += move.template segment<kDim>(first + kTurns);
    }
    return move.template lpNorm<Eigen::Infinity>();
  }
  template <class Normal, class Gradient>
  static void add_normal(const Edge& e, const Normal& normal, const Gradient& part,
                         std::vector<Eigen::Triplet<double>>& entries, Eigen::VectorXd& gradient) {
    const std::size_t ends[2] = {e.from, e.to};
    for (int s = 0; s < 2; ++s) {
      if (ends[s] == 0) continue;
      const auto row = static_cast<Eigen::Index>(kMoves * (ends[s] - 1));
      gradient.segment<kMoves>(row) += part.template segment<kMoves>(s * kMoves);
      for (int t = 0; t < 2; ++t) {
        if (ends[t] == 0) continue;
        const auto column = static_cast<Eigen::Index>(kMoves * (ends[t] - 1));
        for (int r = 0; r < kMoves; ++r)
          for (int c = 0; c < kMoves; ++c)
            entries.emplace_back(row + r, column + c, normal(s * kMoves + r, t * kMoves + c));
      }
    }
  }
};

}  // namespace hm::test
