#include "toile/dynamics/coarse_space.h"

#include "toile/base/parallel.h"
#include "toile/base/result.h"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

#include <algorithm>

namespace toile::dynamics {
namespace {

constexpr int patch_size = 40;  // nodes; from 30 to 60 the total time is about the same
constexpr double float_rounding = 1.2e-7;  // of the sum of a few blocks

using Modes = Eigen::Matrix<double, 3, 6>;
using Block6 = Eigen::Matrix<double, 6, 6>;
using Double4 = Eigen::Vector4d;  // the last one is padding

/// A 3x6 matrix by columns.
struct Columns6 {
  Double4 column[6];
};

Double4 widened(Float4 v) { return {v[0], v[1], v[2], 0}; }

/// Patches of about `size` nodes that hang together in the matrix's graph: each grows breadth first from the free node that
/// was left nearest to the patches before; what stays too small joins a neighbour.
std::vector<int> choose_patches(const BlockMatrix& matrix, int size) {
  const auto n = static_cast<std::size_t>(matrix.rows());
  std::vector<int> patch(n, -1), queue, count, seeds;
  std::size_t next_seed = 0, next_node = 0;
  while (true) {
    int seed = -1;
    while (next_seed < seeds.size() && seed < 0) {
      if (patch[static_cast<std::size_t>(seeds[next_seed])] < 0) seed = seeds[next_seed];
      ++next_seed;
    }
    while (seed < 0 && next_node < n) {
      if (patch[next_node] < 0) seed = static_cast<int>(next_node);
      ++next_node;
    }
    if (seed < 0) break;
    const int id = static_cast<int>(count.size());
    queue.assign(1, seed);
    patch[static_cast<std::size_t>(seed)] = id;
    for (std::size_t head = 0; head < queue.size(); ++head) {
      const auto i = static_cast<std::size_t>(queue[head]);
      for (int k = matrix.row_start[i]; k < matrix.row_start[i + 1]; ++k) {
        const int j = matrix.column[static_cast<std::size_t>(k)];
        if (patch[static_cast<std::size_t>(j)] >= 0) continue;
        if (static_cast<int>(queue.size()) < size) {
          patch[static_cast<std::size_t>(j)] = id;
          queue.push_back(j);
        } else {
          seeds.push_back(j);
        }
      }
    }
    count.push_back(static_cast<int>(queue.size()));
  }
  // Small ones join the neighbour that they touch most.
  std::vector<std::vector<int>> nodes(count.size());
  for (std::size_t i = 0; i < n; ++i) nodes[static_cast<std::size_t>(patch[i])].push_back(static_cast<int>(i));
  for (std::size_t p = 0; p < nodes.size(); ++p) {
    if (static_cast<int>(nodes[p].size()) >= size / 3) continue;
    std::vector<std::pair<int, int>> touches;
    for (int i : nodes[p]) {
      for (int k = matrix.row_start[static_cast<std::size_t>(i)]; k < matrix.row_start[static_cast<std::size_t>(i) + 1]; ++k) {
        const int q = patch[static_cast<std::size_t>(matrix.column[static_cast<std::size_t>(k)])];
        if (q == static_cast<int>(p)) continue;
        const auto it = std::find_if(touches.begin(), touches.end(), [&](const auto& t) { return t.second == q; });
        if (it == touches.end()) touches.emplace_back(-1, q);
        else --it->first;
      }
    }
    if (touches.empty()) continue;
    const int q = std::min_element(touches.begin(), touches.end())->second;
    for (int i : nodes[p]) {
      patch[static_cast<std::size_t>(i)] = q;
      nodes[static_cast<std::size_t>(q)].push_back(i);
    }
    nodes[p].clear();
  }
  std::vector<int> number(nodes.size(), -1);
  int next = 0;
  for (std::size_t p = 0; p < nodes.size(); ++p) {
    if (!nodes[p].empty()) number[p] = next++;
  }
  for (int& p : patch) p = number[static_cast<std::size_t>(p)];
  return patch;
}

}  // namespace

struct CoarseSpace::State {
  std::vector<int> patch;                    // of each node
  std::vector<int> patch_start, patch_node;  // nodes of each patch
  std::vector<std::vector<int>> next;        // patches that the matrix couples to each, itself and higher ones, ascending
  std::vector<Double4> arm;                  // from the centre of the patch to the node, over the patch's size; 0 at fixed nodes
  std::vector<char> fixed;
  std::vector<std::vector<Block6>> blocks;   // of the matrix alone, as `next`
  std::vector<double> rounding;              // of each patch: what single precision leaves uncertain of its stiffness
  std::vector<Eigen::Triplet<double>> triplets;
  Eigen::SparseMatrix<double> matrix;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::AMDOrdering<int>> factor;
  Eigen::VectorXd rhs, solution;

  int patches() const { return static_cast<int>(patch_start.size()) - 1; }

  /// Motion of a node for unit motions of its patch: identity and, for turns w, w x arm.
  Modes modes(int node) const {
    Modes m = Modes::Zero();
    const auto i = static_cast<std::size_t>(node);
    if (fixed[i]) return m;
    m.leftCols<3>().setIdentity();
    const Double4 r = arm[i];
    m(0, 4) = r[2], m(0, 5) = -r[1];
    m(1, 3) = -r[2], m(1, 5) = r[0];
    m(2, 3) = r[1], m(2, 4) = -r[0];
    return m;
  }

  void choose(const BlockMatrix& a);
  void measure_arms(const mesh::Points3& x);
  void project(const BlockMatrix& a);
  void project(const ContactTerm& term);
  void add(int p, int q, const Block6& block);
};

void CoarseSpace::State::choose(const BlockMatrix& a) {
  const auto n = static_cast<std::size_t>(a.rows());
  patch = choose_patches(a, patch_size);
  const auto count = static_cast<std::size_t>(patch.empty() ? 0 : *std::max_element(patch.begin(), patch.end()) + 1);
  patch_start.assign(count + 1, 0);
  for (int p : patch) ++patch_start[static_cast<std::size_t>(p) + 1];
  for (std::size_t p = 1; p < patch_start.size(); ++p) patch_start[p] += patch_start[p - 1];
  patch_node.resize(n);
  std::vector<int> at(patch_start.begin(), patch_start.end() - 1);
  for (std::size_t i = 0; i < n; ++i) patch_node[static_cast<std::size_t>(at[static_cast<std::size_t>(patch[i])]++)] = static_cast<int>(i);
  next.assign(count, {});
  blocks.assign(count, {});
  rounding.assign(count, 0);
  for (std::size_t p = 0; p < count; ++p) {
    for (int k = patch_start[p]; k < patch_start[p + 1]; ++k) {
      const auto i = static_cast<std::size_t>(patch_node[static_cast<std::size_t>(k)]);
      for (int m = a.row_start[i]; m < a.row_start[i + 1]; ++m) {
        const int q = patch[static_cast<std::size_t>(a.column[static_cast<std::size_t>(m)])];
        if (q >= static_cast<int>(p)) next[p].push_back(q);
      }
    }
    std::sort(next[p].begin(), next[p].end());
    next[p].erase(std::unique(next[p].begin(), next[p].end()), next[p].end());
  }
}

void CoarseSpace::State::measure_arms(const mesh::Points3& x) {
  arm.assign(patch.size(), Double4::Zero());
  for (std::size_t p = 0; p + 1 < patch_start.size(); ++p) {
    Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
    for (int k = patch_start[p]; k < patch_start[p + 1]; ++k) centre += x.row(patch_node[static_cast<std::size_t>(k)]);
    centre /= patch_start[p + 1] - patch_start[p];
    double size = 1e-12;
    for (int k = patch_start[p]; k < patch_start[p + 1]; ++k) size = std::max(size, (x.row(patch_node[static_cast<std::size_t>(k)]) - centre).norm());
    for (int k = patch_start[p]; k < patch_start[p + 1]; ++k) {
      const auto i = static_cast<std::size_t>(patch_node[static_cast<std::size_t>(k)]);
      const Eigen::RowVector3d d = (x.row(static_cast<Eigen::Index>(i)) - centre) / size;
      if (!fixed[i]) arm[i] = {d.x(), d.y(), d.z(), 0};
    }
  }
}

/// blocks[p][slot] = sum over nodes i of p, j of next[p][slot] of modes(i)^T A_ij modes(j)
void CoarseSpace::State::project(const BlockMatrix& a) {
  parallel_for(next.size(), 4, [&](std::size_t p) {
    const std::vector<int>& list = next[p];
    blocks[p].assign(list.size(), Block6::Zero());
    Columns6 zero;
    for (Double4& column : zero.column) column.setZero();
    std::vector<Columns6> sum(list.size(), zero);
    double stiffness = 0;
    for (int k = patch_start[p]; k < patch_start[p + 1]; ++k) {
      const int node = patch_node[static_cast<std::size_t>(k)];
      const auto i = static_cast<std::size_t>(node);
      if (fixed[i]) continue;
      const Block& own_block = a.value[static_cast<std::size_t>(a.diagonal[i])];
      for (int c = 0; c < 3; ++c) stiffness += static_cast<double>(own_block.column[c][c]);
      std::fill(sum.begin(), sum.end(), zero);
      for (int m = a.row_start[i]; m < a.row_start[i + 1]; ++m) {
        const auto j = static_cast<std::size_t>(a.column[static_cast<std::size_t>(m)]);
        const int q = patch[j];
        if (q < static_cast<int>(p) || fixed[j]) continue;
        Columns6& c = sum[static_cast<std::size_t>(std::lower_bound(list.begin(), list.end(), q) - list.begin())];
        const Block& block = a.value[static_cast<std::size_t>(m)];
        const Double4 b0 = widened(block.column[0]), b1 = widened(block.column[1]), b2 = widened(block.column[2]);
        const Double4& r = arm[j];
        c.column[0] += b0;
        c.column[1] += b1;
        c.column[2] += b2;
        c.column[3] += b2 * r[1] - b1 * r[2];
        c.column[4] += b0 * r[2] - b2 * r[0];
        c.column[5] += b1 * r[0] - b0 * r[1];
      }
      const Double4 r = arm[i];
      for (std::size_t slot = 0; slot < list.size(); ++slot) {
        Block6& own = blocks[p][slot];
        for (int c = 0; c < 6; ++c) {
          const Double4 f = sum[slot].column[c];
          own(0, c) += f[0];
          own(1, c) += f[1];
          own(2, c) += f[2];
          own(3, c) += r[1] * f[2] - r[2] * f[1];
          own(4, c) += r[2] * f[0] - r[0] * f[2];
          own(5, c) += r[0] * f[1] - r[1] * f[0];
        }
      }
    }
    rounding[p] = float_rounding * stiffness;
  });
}

/// Into the lower triangle.
void CoarseSpace::State::add(int p, int q, const Block6& block) {
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) {
      if (6 * q + c >= 6 * p + r) triplets.emplace_back(6 * q + c, 6 * p + r, block(r, c));
    }
  }
}

void CoarseSpace::State::project(const ContactTerm& term) {
  const Eigen::Matrix3d block = term.block.matrix();
  std::array<Modes, 4> g;
  std::array<int, 4> of{};
  std::size_t used = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    if (term.node[k] < 0) continue;
    const int p = patch[static_cast<std::size_t>(term.node[k])];
    std::size_t slot = 0;
    while (slot < used && of[slot] != p) ++slot;
    if (slot == used) {
      of[slot] = p;
      g[slot].setZero();
      ++used;
    }
    g[slot] += static_cast<double>(term.weight[k]) * modes(term.node[k]);
  }
  for (std::size_t i = 0; i < used; ++i) {
    for (std::size_t j = 0; j < used; ++j) {
      if (of[j] >= of[i]) add(of[i], of[j], g[i].transpose() * block * g[j]);
    }
  }
}

CoarseSpace::CoarseSpace() : state_(std::make_unique<State>()) {}
CoarseSpace::~CoarseSpace() = default;
CoarseSpace::CoarseSpace(CoarseSpace&&) noexcept = default;
CoarseSpace& CoarseSpace::operator=(CoarseSpace&&) noexcept = default;
int CoarseSpace::patches() const { return state_->patches(); }
bool CoarseSpace::fits(const BlockMatrix& matrix) const { return state_->patch.size() == static_cast<std::size_t>(matrix.rows()) && !state_->patch.empty(); }

void CoarseSpace::factor(const BlockMatrix& matrix, const std::vector<ContactTerm>& terms, const mesh::Points3& x, const std::vector<char>& fixed) {
  State& s = *state_;
  if (s.patch.size() != static_cast<std::size_t>(matrix.rows())) s.choose(matrix);
  s.fixed = fixed;
  s.measure_arms(x);
  s.project(matrix);
  s.triplets.clear();
  for (std::size_t p = 0; p < s.next.size(); ++p) {
    for (std::size_t slot = 0; slot < s.next[p].size(); ++slot) s.add(static_cast<int>(p), s.next[p][slot], s.blocks[p][slot]);
  }
  for (const ContactTerm& term : terms) s.project(term);
  const int unknowns = 6 * s.patches();
  s.matrix.resize(unknowns, unknowns);
  s.matrix.setFromTriplets(s.triplets.begin(), s.triplets.end());
  // A patch of fixed nodes has no motion, one along a line no turn about it, and single precision leaves the matrix only nearly
  // positive: a small shift mends all three. Where next to nothing holds a body the stiffnesses of its blocks cancel, and what is left on the
  // diagonal is their rounding, of either sign: then the rounding is what the shift is measured by.
  s.factor.analyzePattern(s.matrix);
  Eigen::VectorXd diagonal = s.matrix.diagonal();
  const double least = 1e-9 * std::max(diagonal.maxCoeff(), 1e-30);
  for (int k = 0; k < unknowns; ++k) diagonal[k] = std::max(diagonal[k], s.rounding[static_cast<std::size_t>(k / 6)]);
  for (double shift = 1e-6; ; shift *= 30) {
    for (int k = 0; k < unknowns; ++k) s.matrix.coeffRef(k, k) = diagonal[k] * (1 + shift) + least;
    s.factor.factorize(s.matrix);
    if (s.factor.info() == Eigen::Success) break;
    TOILE_CHECK(shift < 1e3, "the coarse matrix of {} patches is not positive definite: shift {}", s.patches(), shift);
  }
  s.rhs.resize(unknowns);
}

void CoarseSpace::solve(const std::vector<Float4>& r) {
  State& s = *state_;
  for (std::size_t p = 0; p < s.next.size(); ++p) {
    std::array<double, 6> sum{};
    for (int k = s.patch_start[p]; k < s.patch_start[p + 1]; ++k) {
      const auto i = static_cast<std::size_t>(s.patch_node[static_cast<std::size_t>(k)]);
      if (s.fixed[i]) continue;
      const Double4 f = widened(r[i]), arm = s.arm[i];
      for (std::size_t c = 0; c < 3; ++c) sum[c] += f[c];
      sum[3] += arm[1] * f[2] - arm[2] * f[1];
      sum[4] += arm[2] * f[0] - arm[0] * f[2];
      sum[5] += arm[0] * f[1] - arm[1] * f[0];
    }
    for (std::size_t c = 0; c < 6; ++c) s.rhs[static_cast<Eigen::Index>(6 * p + c)] = sum[c];
  }
  s.solution = s.factor.solve(s.rhs);
}

Float4 CoarseSpace::correction(std::size_t node) const {
  const State& s = *state_;
  if (s.fixed[node]) return Float4{};
  const double* c = s.solution.data() + 6 * s.patch[node];
  const Double4 arm = s.arm[node];
  const double d[3] = {c[0] + c[4] * arm[2] - c[5] * arm[1], c[1] + c[5] * arm[0] - c[3] * arm[2], c[2] + c[3] * arm[1] - c[4] * arm[0]};
  return mechanics::load3(d);
}

}  // namespace toile::dynamics
