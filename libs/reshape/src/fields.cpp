#include "fields.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace toile::reshape {

using Eigen::Vector3d;
using Sparse = Eigen::SparseMatrix<double>;

Operators operators(const Points3& x, const Triangles& faces) {
  Operators op{Sparse(x.rows(), x.rows()), Eigen::VectorXd::Zero(x.rows())};
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Vector3d u = x.row(faces(f, 1)) - x.row(faces(f, 0)), w = x.row(faces(f, 2)) - x.row(faces(f, 0));
    const double area2 = u.cross(w).norm();
    if (!(area2 > 1e-16)) continue;
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, k), b = faces(f, (k + 1) % 3), c = faces(f, (k + 2) % 3);
      const double half_cot = 0.5 * Vector3d(x.row(b) - x.row(a)).dot(Vector3d(x.row(c) - x.row(a))) / area2;
      entries.insert(entries.end(), {{b, b, half_cot}, {c, c, half_cot}, {b, c, -half_cot}, {c, b, -half_cot}});
      op.mass[a] += area2 / 6;
    }
  }
  op.laplacian.setFromTriplets(entries.begin(), entries.end());
  return op;
}

Points3 biharmonic_field(const Operators& op, const std::vector<State>& state, const Points3& value) {
  const Eigen::Index n = op.laplacian.rows();
  Points3 field = Points3::Zero(n, 3);
  std::vector<int> row(static_cast<std::size_t>(n), -1);
  int unknowns = 0;
  for (Eigen::Index v = 0; v < n; ++v) {
    const State s = state[static_cast<std::size_t>(v)];
    if (s == State::free) row[static_cast<std::size_t>(v)] = unknowns++;
    if (s == State::given) field.row(v) = value.row(v);
  }
  if (unknowns == 0) return field;
  // Only the columns of free vertices; what is given goes to the right hand side.
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index v = 0; v < n; ++v) {
    if (row[static_cast<std::size_t>(v)] < 0) continue;
    for (Sparse::InnerIterator it(op.laplacian, v); it; ++it) {
      const double mass = op.mass[it.row()];
      entries.emplace_back(static_cast<int>(it.row()), row[static_cast<std::size_t>(v)], mass > 0 ? it.value() / std::sqrt(mass) : 0);
    }
  }
  Sparse root(n, unknowns);
  root.setFromTriplets(entries.begin(), entries.end());
  Points3 given = op.laplacian * field;
  for (Eigen::Index v = 0; v < n; ++v) given.row(v) *= op.mass[v] > 0 ? 1 / std::sqrt(op.mass[v]) : 0;
  const Sparse matrix = root.transpose() * root;
  const Eigen::SimplicialLDLT<Sparse> solver(matrix);
  TOILE_CHECK(solver.info() == Eigen::Success, "biharmonic system of {} unknowns", unknowns);
  const Eigen::MatrixXd right = -(root.transpose() * given);
  const Eigen::MatrixXd solved = solver.solve(right);
  for (Eigen::Index v = 0; v < n; ++v) {
    if (row[static_cast<std::size_t>(v)] >= 0) field.row(v) = solved.row(row[static_cast<std::size_t>(v)]);
  }
  return field;
}

std::vector<std::vector<int>> neighbours(Eigen::Index vertices, const Triangles& faces) {
  std::vector<std::vector<int>> near(static_cast<std::size_t>(vertices));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      near[static_cast<std::size_t>(faces(f, k))].push_back(faces(f, (k + 1) % 3));
      near[static_cast<std::size_t>(faces(f, k))].push_back(faces(f, (k + 2) % 3));
    }
  }
  for (auto& list : near) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return near;
}

std::vector<double> edge_distances(const Points3& x, const Triangles& faces, const std::vector<int>& seeds, const std::vector<char>& open) {
  const auto near = neighbours(x.rows(), faces);
  std::vector<double> distance(static_cast<std::size_t>(x.rows()), std::numeric_limits<double>::infinity());
  using Item = std::pair<double, int>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  for (const int seed : seeds) {
    distance[static_cast<std::size_t>(seed)] = 0;
    queue.emplace(0, seed);
  }
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > distance[static_cast<std::size_t>(v)]) continue;
    for (const int w : near[static_cast<std::size_t>(v)]) {
      if (!open[static_cast<std::size_t>(w)]) continue;
      const double through = d + (x.row(v) - x.row(w)).norm();
      if (through >= distance[static_cast<std::size_t>(w)]) continue;
      distance[static_cast<std::size_t>(w)] = through;
      queue.emplace(through, w);
    }
  }
  return distance;
}

}  // namespace toile::reshape
