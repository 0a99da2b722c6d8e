#include "unfold.h"

#include "toile/base/result.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <cmath>
#include <vector>

namespace toile::reshape {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Sparse = Eigen::SparseMatrix<double>;
using Entry = Eigen::Triplet<double>;

namespace {

/// A face laid flat by itself, counter-clockwise, and the half cotangents opposite its corners.
struct Flat {
  std::array<Vector2d, 3> p;
  std::array<double, 3> half_cot;
  double area;
};

std::vector<Flat> flat_faces(const Points3& x, const Triangles& faces) {
  std::vector<Flat> flat;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Vector3d a = x.row(faces(f, 0)), u = x.row(faces(f, 1)).transpose() - a, w = x.row(faces(f, 2)).transpose() - a;
    const double length = u.norm(), area2 = u.cross(w).norm();
    Flat t;
    t.p = {Vector2d::Zero(), Vector2d(length, 0), Vector2d(w.dot(u) / length, area2 / length)};
    t.area = area2 / 2;
    for (std::size_t k = 0; k < 3; ++k) t.half_cot[k] = 0.5 * (t.p[(k + 1) % 3] - t.p[k]).dot(t.p[(k + 2) % 3] - t.p[k]) / area2;
    flat.push_back(t);
  }
  return flat;
}

/// Least-squares conformal map: Dirichlet energy less area, two vertices held.
Points2 conformal(const Points3& x, const Triangles& faces, const std::vector<Flat>& flat) {
  const int n = static_cast<int>(x.rows());
  const std::vector<int> border = mesh::border_loops(faces).front();
  // Two vertices of the border far apart.
  const auto farthest = [&](int from) {
    int best = border.front();
    for (const int v : border) {
      if ((x.row(v) - x.row(from)).squaredNorm() > (x.row(best) - x.row(from)).squaredNorm()) best = v;
    }
    return best;
  };
  const int one = farthest(border.front()), two = farthest(one);
  std::vector<int> row(static_cast<std::size_t>(2 * n), 0);
  for (const int v : {one, two}) row[static_cast<std::size_t>(v)] = row[static_cast<std::size_t>(n + v)] = -1;
  int unknowns = 0;
  for (int& r : row) r = r < 0 ? -1 : unknowns++;
  Eigen::VectorXd held = Eigen::VectorXd::Zero(2 * n), right = Eigen::VectorXd::Zero(unknowns);
  held[two] = (x.row(two) - x.row(one)).norm();
  std::vector<Entry> entries;
  const auto add = [&](int i, int j, double value) {
    const int r = row[static_cast<std::size_t>(i)], c = row[static_cast<std::size_t>(j)];
    if (r < 0) return;
    if (c < 0) right[r] -= value * held[j];
    else entries.emplace_back(r, c, value);
  };
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, (k + 1) % 3), b = faces(f, (k + 2) % 3);
      const double w = flat[static_cast<std::size_t>(f)].half_cot[static_cast<std::size_t>(k)];
      for (const int shift : {0, n}) {
        add(a + shift, a + shift, w), add(b + shift, b + shift, w);
        add(a + shift, b + shift, -w), add(b + shift, a + shift, -w);
      }
    }
  }
  for (std::size_t i = 0; i < border.size(); ++i) {
    const int a = border[i], b = border[(i + 1) % border.size()];
    add(a, n + b, -0.5), add(n + b, a, -0.5);
    add(b, n + a, 0.5), add(n + a, b, 0.5);
  }
  Sparse matrix(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> solver(matrix);
  TOILE_CHECK(solver.info() == Eigen::Success, "conformal map of {} vertices", n);
  const Eigen::VectorXd z = solver.solve(right);
  Points2 uv(n, 2);
  for (int v = 0; v < n; ++v) {
    for (int k = 0; k < 2; ++k) {
      const int r = row[static_cast<std::size_t>(v + k * n)];
      uv(v, k) = r < 0 ? held[v + k * n] : z[r];
    }
  }
  double area = 0, wanted = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Vector2d a = uv.row(faces(f, 0)), u = uv.row(faces(f, 1)).transpose() - a, w = uv.row(faces(f, 2)).transpose() - a;
    area += 0.5 * (u.x() * w.y() - u.y() * w.x());
    wanted += flat[static_cast<std::size_t>(f)].area;
  }
  if (area > 0) uv *= std::sqrt(wanted / area);
  return uv;
}

}  // namespace

Points2 unfold(const Points3& x, const Triangles& faces, double settled) {
  const std::vector<Flat> flat = flat_faces(x, faces);
  const int n = static_cast<int>(x.rows());
  Points2 uv = conformal(x, faces, flat);
  // Vertex 0 stays: the Laplacian without its row is positive definite.
  std::vector<Entry> entries;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, (k + 1) % 3) - 1, b = faces(f, (k + 2) % 3) - 1;
      const double w = flat[static_cast<std::size_t>(f)].half_cot[static_cast<std::size_t>(k)];
      if (a >= 0) entries.emplace_back(a, a, w);
      if (b >= 0) entries.emplace_back(b, b, w);
      if (a >= 0 && b >= 0) entries.emplace_back(a, b, -w), entries.emplace_back(b, a, -w);
    }
  }
  Sparse matrix(n - 1, n - 1);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> solver(matrix);
  TOILE_CHECK(solver.info() == Eigen::Success, "flattening of {} vertices", n);
  const double size = (x.colwise().maxCoeff() - x.colwise().minCoeff()).norm();
  constexpr int most = 2000;
  for (int round = 0; round < most; ++round) {
    Points2 right = Points2::Zero(n, 2);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      const Flat& t = flat[static_cast<std::size_t>(f)];
      double c = 0, s = 0;  // the rotation nearest to the map of this face
      for (int k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>((k + 1) % 3), j = static_cast<std::size_t>((k + 2) % 3);
        const Vector2d p = t.p[j] - t.p[i], q = (uv.row(faces(f, static_cast<int>(j))) - uv.row(faces(f, static_cast<int>(i)))).transpose();
        const double w = t.half_cot[static_cast<std::size_t>(k)];
        c += w * p.dot(q);
        s += w * (p.x() * q.y() - p.y() * q.x());
      }
      const double norm = std::hypot(c, s);
      if (norm > 0) c /= norm, s /= norm;
      else c = 1, s = 0;
      Matrix2d rotation;
      rotation << c, -s, s, c;
      for (int k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>((k + 1) % 3), j = static_cast<std::size_t>((k + 2) % 3);
        const Vector2d pull = t.half_cot[static_cast<std::size_t>(k)] * (rotation * (t.p[j] - t.p[i]));
        right.row(faces(f, static_cast<int>(j))) += pull.transpose();
        right.row(faces(f, static_cast<int>(i))) -= pull.transpose();
      }
    }
    const Eigen::MatrixXd rest = solver.solve(right.bottomRows(n - 1).eval());
    Points2 next = Points2::Zero(n, 2);
    next.bottomRows(n - 1) = rest;
    next.rowwise() += uv.row(0);
    const double move = (next - uv).rowwise().norm().maxCoeff();
    uv = next;
    if (move < settled * size) break;
  }
  return uv;
}

Points2 stretches(const Points3& x, const Points2& uv, const Triangles& faces) {
  const std::vector<Flat> flat = flat_faces(x, faces);
  Points2 result(faces.rows(), 2);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Flat& t = flat[static_cast<std::size_t>(f)];
    Matrix2d from, to;
    from << t.p[1] - t.p[0], t.p[2] - t.p[0];
    to << (uv.row(faces(f, 1)) - uv.row(faces(f, 0))).transpose(), (uv.row(faces(f, 2)) - uv.row(faces(f, 0))).transpose();
    const Matrix2d map = to * from.inverse();
    const Vector2d s = map.jacobiSvd().singularValues();
    result.row(f) << s[0], map.determinant() < 0 ? -s[1] : s[1];
  }
  return result;
}

}  // namespace toile::reshape
