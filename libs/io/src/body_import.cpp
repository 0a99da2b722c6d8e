#include "toile/io/body_import.h"

#include "body_regions.h"
#include "toile/geometry/wrap.h"
#include "toile/mesh/topology.h"

#include <assimp/scene.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <deque>
#include <filesystem>
#include <map>
#include <numeric>
#include <stdexcept>

namespace toile::io {

using Eigen::Vector3d;

namespace {

double metres(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::m: return 1;
    case LengthUnit::cm: return 0.01;
    case LengthUnit::mm: return 0.001;
    case LengthUnit::in: return 0.0254;
  }
  return 1;
}

Vector3d direction(Axis axis) {
  const int k = static_cast<int>(axis);
  return Vector3d::Unit(k % 3) * (k < 3 ? 1 : -1);
}

std::string place(const Vector3d& p) { return fmt::format("({:.3f}, {:.3f}, {:.3f}) m", p.x(), p.y(), p.z()); }

/// Triangles of a flat or slightly bent polygon by cutting ears; the polygon's own order is kept.
std::vector<std::array<int, 3>> triangulated(const std::vector<Vector3d>& points, std::vector<int> ring) {
  std::vector<std::array<int, 3>> result;
  Vector3d normal = Vector3d::Zero();
  for (std::size_t i = 0; i < ring.size(); ++i) {
    normal += points[static_cast<std::size_t>(ring[i])].cross(points[static_cast<std::size_t>(ring[(i + 1) % ring.size()])]);
  }
  const auto at = [&](std::size_t i) -> const Vector3d& { return points[static_cast<std::size_t>(ring[i % ring.size()])]; };
  const auto turn = [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) { return (b - a).cross(c - a).dot(normal); };
  while (ring.size() > 3) {
    const std::size_t n = ring.size();
    std::size_t ear = n;
    for (std::size_t i = 0; i < n && ear == n; ++i) {
      const Vector3d &a = at(i + n - 1), &b = at(i), &c = at(i + 1);
      if (turn(a, b, c) <= 0) continue;
      bool free = true;
      for (std::size_t j = i + 2; j < i + n - 1 && free; ++j) {
        const Vector3d& q = at(j);
        free = turn(a, b, q) < 0 || turn(b, c, q) < 0 || turn(c, a, q) < 0;
      }
      if (free) ear = i;
    }
    if (ear == n) ear = 0;  // a crossed or degenerate polygon: its triangles are checked like all others
    result.push_back({ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  result.push_back({ring[0], ring[1], ring[2]});
  return result;
}

int byte(float share) { return static_cast<int>(std::lround(255 * std::clamp(share, 0.0f, 1.0f))); }

/// Colour of at least two of the three corners, to within 2 of 255; -1: there is none.
int common_color(const std::array<std::array<int, 3>, 3>& corners) {
  const auto alike = [](const std::array<int, 3>& a, const std::array<int, 3>& b) {
    return std::abs(a[0] - b[0]) <= 2 && std::abs(a[1] - b[1]) <= 2 && std::abs(a[2] - b[2]) <= 2;
  };
  for (const std::size_t k : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
    if (alike(corners[k], corners[(k + 1) % 3])) return corners[k][0] << 16 | corners[k][1] << 8 | corners[k][2];
  }
  return -1;
}

void collect(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, std::vector<Vector3d>& points, std::vector<std::array<int, 3>>& faces, FaceMarks& marks) {
  const aiMatrix4x4 here = parent * node.mTransformation;
  const bool mirrored = here.Determinant() < 0;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    const aiMesh& m = *scene.mMeshes[node.mMeshes[i]];
    const int base = static_cast<int>(points.size());
    for (unsigned v = 0; v < m.mNumVertices; ++v) {
      const aiVector3D p = here * m.mVertices[v];
      points.emplace_back(p.x, p.y, p.z);
    }
    const int part = static_cast<int>(marks.parts.size());
    std::vector<std::string>& names = marks.parts.emplace_back();
    names = {node.mName.C_Str(), m.mName.C_Str()};
    if (m.mMaterialIndex < scene.mNumMaterials) names.emplace_back(scene.mMaterials[m.mMaterialIndex]->GetName().C_Str());
    for (unsigned f = 0; f < m.mNumFaces; ++f) {
      if (m.mFaces[f].mNumIndices < 3) continue;  // points and lines
      std::vector<int> ring;
      for (unsigned k = 0; k < m.mFaces[f].mNumIndices; ++k) {
        if (m.mFaces[f].mIndices[k] >= m.mNumVertices) throw std::runtime_error("a face names a vertex that is not there");
        ring.push_back(base + static_cast<int>(m.mFaces[f].mIndices[k]));
      }
      if (mirrored) std::reverse(ring.begin(), ring.end());
      for (const auto& face : triangulated(points, ring)) {
        faces.push_back(face);
        marks.part.push_back(part);
        marks.color.push_back(-1);
        if (!m.mColors[0]) continue;
        std::array<std::array<int, 3>, 3> corners;
        for (const std::size_t k : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
          const aiColor4D& c = m.mColors[0][face[k] - base];
          corners[k] = {byte(c.r), byte(c.g), byte(c.b)};
        }
        marks.color.back() = common_color(corners);
      }
    }
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) collect(scene, *node.mChildren[i], here, points, faces, marks);
}

/// Piece of every face, numbered by the lowest face.
std::vector<int> piece_of_faces(const mesh::Triangles& faces, int vertices) {
  std::vector<int> root(static_cast<std::size_t>(vertices));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int a) {
    while (root[static_cast<std::size_t>(a)] != a) {
      root[static_cast<std::size_t>(a)] = root[static_cast<std::size_t>(root[static_cast<std::size_t>(a)])];
      a = root[static_cast<std::size_t>(a)];
    }
    return a;
  };
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 1; k < 3; ++k) {
      const int a = find(faces(f, 0)), b = find(faces(f, k));
      root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  std::map<int, int> number;
  std::vector<int> piece;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    piece.push_back(number.try_emplace(find(faces(f, 0)), static_cast<int>(number.size())).first->second);
  }
  return piece;
}

/// Turns faces so that neighbours agree, spreading from the lowest face of each piece.
void agree(mesh::Triangles& faces) {
  std::map<std::pair<int, int>, std::vector<int>> by_edge;
  for (int f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, k), b = faces(f, (k + 1) % 3);
      by_edge[{std::min(a, b), std::max(a, b)}].push_back(f);
    }
  }
  std::vector<char> seen(static_cast<std::size_t>(faces.rows()), 0);
  const auto runs = [&](int f, int a, int b) {
    for (int k = 0; k < 3; ++k) {
      if (faces(f, k) == a && faces(f, (k + 1) % 3) == b) return true;
    }
    return false;
  };
  for (int seed = 0; seed < faces.rows(); ++seed) {
    if (seen[static_cast<std::size_t>(seed)]) continue;
    seen[static_cast<std::size_t>(seed)] = 1;
    std::deque<int> open{seed};
    while (!open.empty()) {
      const int f = open.front();
      open.pop_front();
      for (int k = 0; k < 3; ++k) {
        const int a = faces(f, k), b = faces(f, (k + 1) % 3);
        const auto& both = by_edge.at({std::min(a, b), std::max(a, b)});
        if (both.size() != 2) continue;
        const int g = both[0] == f ? both[1] : both[0];
        if (seen[static_cast<std::size_t>(g)]) continue;
        if (runs(g, a, b)) std::swap(faces(g, 1), faces(g, 2));
        seen[static_cast<std::size_t>(g)] = 1;
        open.push_back(g);
      }
    }
  }
}

void check_size(const mesh::Points3& x, const std::string& name, const BodyImportParams& params, Issues& issues) {
  const Vector3d extent = x.colwise().maxCoeff() - x.colwise().minCoeff();
  const double size = extent.maxCoeff();
  if (size >= params.smallest_size && size <= params.largest_size) return;
  const double in_file = size / metres(params.unit);
  std::string fitting;
  for (const auto& [label, unit] : Choices<LengthUnit>::names) {
    const double other = in_file * metres(unit);
    if (unit != params.unit && other >= params.smallest_size && other <= params.largest_size) {
      fitting += fmt::format("{}unit {} would make it {:.3g} m", fitting.empty() ? "" : ", ", label, other);
    }
  }
  issues.push_back(Issue{"implausible_size", {.file = name, .item = "unit"},
                         fmt::format("the body would be {:.6g} m large, outside {:g} to {:g} m", size, params.smallest_size, params.largest_size),
                         fitting.empty() ? "give its unit, or widen smallest_size and largest_size" : fitting + "; or widen smallest_size and largest_size"});
}

void check_surface(const mesh::Points3& x, const mesh::Triangles& faces, const std::string& name, Issues& issues) {
  std::map<std::pair<int, int>, std::pair<int, int>> directed;  // edge -> uses forward, backward
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, k), b = faces(f, (k + 1) % 3);
      auto& uses = directed[{std::min(a, b), std::max(a, b)}];
      (a < b ? uses.first : uses.second) += 1;
    }
  }
  struct Tally {
    int count = 0;
    std::vector<Vector3d> where;
    void add(const Vector3d& p) {
      if (++count <= 3) where.push_back(p);
    }
    std::string places() const {
      std::string text;
      for (const Vector3d& p : where) text += (text.empty() ? "" : ", ") + place(p);
      return text + (count > 3 ? ", …" : "");
    }
  };
  Tally open, crowded, disagree;
  for (const auto& [edge, uses] : directed) {
    const Vector3d middle = (x.row(edge.first) + x.row(edge.second)).transpose() / 2;
    const int total = uses.first + uses.second;
    if (total == 1) open.add(middle);
    else if (total > 2) crowded.add(middle);
    else if (uses.first != 1) disagree.add(middle);
  }
  if (open.count > 0) {
    issues.push_back(Issue{"open_surface", {.file = name}, fmt::format("{} edges have a face on one side only, at {}", open.count, open.places()),
                           "close the holes; parts such as eyes or lashes can be left out with pieces: largest"});
  }
  if (crowded.count > 0) {
    issues.push_back(Issue{"not_manifold", {.file = name}, fmt::format("{} edges have more than two faces, at {}", crowded.count, crowded.places()),
                           "remove doubled or inner faces"});
  }
  if (disagree.count > 0) {
    issues.push_back(Issue{"not_oriented", {.file = name}, fmt::format("the faces at {} edges look to opposite sides, at {}", disagree.count, disagree.places()),
                           "turn faces consistently, or ask for winding: outward"});
  }
}

int open_edges(const mesh::Triangles& faces) {
  std::map<std::pair<int, int>, int> uses;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, k), b = faces(f, (k + 1) % 3);
      ++uses[{std::min(a, b), std::max(a, b)}];
    }
  }
  return static_cast<int>(std::count_if(uses.begin(), uses.end(), [](const auto& u) { return u.second == 1; }));
}

/// A wrap that went in through a hole lines both sides of the body, with hardly any volume between them. The volume of an open
/// piece about its own middle is good enough to tell.
void check_wrap(const mesh::Points3& x, const mesh::Triangles& faces, double largest_piece, const std::string& name, const BodyImportParams& params, Issues& issues) {
  const double volume = mesh::volume(x, faces);
  if (volume >= 0.8 * largest_piece) return;
  issues.push_back(Issue{"wrap_enters", {.file = name, .item = "wrap"},
                         fmt::format("the closed surface holds {:.3g} m3, the largest piece about {:.3g} m3: it goes in through a hole wider than {:.3g} mm and lines the inside",
                                     volume, largest_piece, 1000 * params.wrap),
                         "raise wrap above the width of the largest hole"});
}

}  // namespace

Result<ImportedBody> import_body(const std::string& path, const BodyImportParams& params) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return Issue{"cannot_read", {.file = path}, "there is no such file", "check the path"};
  if (std::filesystem::is_directory(path, error)) return Issue{"cannot_read", {.file = path}, "is a directory", "name a mesh file"};
  if (std::filesystem::file_size(path, error) == 0) return Issue{"cannot_read", {.file = path}, "the file is empty", "export the body again"};
  std::vector<Vector3d> points;
  std::vector<std::array<int, 3>> faces;
  FaceMarks marks;
  try {
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(path, 0);
    if (!scene || !scene->mRootNode) {
      const std::string why = importer.GetErrorString();
      return Issue{"cannot_read", {.file = path}, "not a mesh that can be read" + (why.empty() ? "" : " (" + why + ")"),
                   "export the body as OBJ, STL, PLY or glTF"};
    }
    collect(*scene, *scene->mRootNode, aiMatrix4x4(), points, faces, marks);
  } catch (const std::exception& e) {
    return Issue{"cannot_read", {.file = path}, fmt::format("not a mesh that can be read ({})", e.what()), "export the body as OBJ, STL, PLY or glTF"};
  }
  if (faces.empty()) return Issue{"cannot_read", {.file = path}, "the file has no faces", "export a surface, not points or curves"};
  mesh::Points3 x(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) x.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  mesh::Triangles t(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) t.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  return import_body(std::move(x), std::move(t), path, params, marks);
}

Result<ImportedBody> import_body(mesh::Points3 x, mesh::Triangles faces, const std::string& name, const BodyImportParams& params, const FaceMarks& marks) {
  Issues issues = validate(params);
  for (Issue& issue : issues) issue.category = Category::usage;
  if (!issues.empty()) return issues;
  if (x.rows() == 0 || faces.rows() == 0) return Issue{"cannot_read", {.file = name}, "the file has no faces", "export a surface, not points or curves"};
  if (!x.allFinite()) return Issue{"cannot_read", {.file = name}, "a coordinate is not a finite number", "export the body again"};
  if (faces.minCoeff() < 0 || faces.maxCoeff() >= x.rows()) return Issue{"cannot_read", {.file = name}, "a face names a vertex that is not there", "export the body again"};

  // target_from_source: up -> y, facing -> z, and the left hand, up x facing, -> x.
  const Vector3d up = direction(params.up), facing = direction(params.facing);
  Eigen::Matrix3d world_from_file;
  world_from_file << up.cross(facing).transpose(), up.transpose(), facing.transpose();
  x = (x * world_from_file.transpose() * metres(params.unit)).eval();

  ImportedBody body;
  std::vector<int> source;  // of each face, its row as it came
  // Equal positions become one vertex, in order of first use.
  {
    const auto less = [](const Vector3d& a, const Vector3d& b) { return std::tie(a.x(), a.y(), a.z()) < std::tie(b.x(), b.y(), b.z()); };
    std::map<Vector3d, int, decltype(less)> known(less);
    std::vector<Vector3d> kept;
    std::vector<char> used(static_cast<std::size_t>(x.rows()), 0);
    mesh::Triangles welded(faces.rows(), 3);
    Eigen::Index count = 0;
    int used_rows = 0;
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      std::array<int, 3> v;
      for (int k = 0; k < 3; ++k) {
        const int row = faces(f, k);
        if (!used[static_cast<std::size_t>(row)]) ++used_rows, used[static_cast<std::size_t>(row)] = 1;
        const Vector3d p = x.row(row).array() + 0.0;  // -0 and 0 are equal
        const auto [it, fresh] = known.try_emplace(p, static_cast<int>(kept.size()));
        if (fresh) kept.push_back(p);
        v[static_cast<std::size_t>(k)] = it->second;
      }
      if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
        ++body.dropped_faces;
        continue;
      }
      welded.row(count++) << v[0], v[1], v[2];
      source.push_back(static_cast<int>(f));
    }
    body.joined_corners = used_rows - static_cast<int>(kept.size());
    faces = welded.topRows(count);
    x.resize(static_cast<Eigen::Index>(kept.size()), 3);
    for (std::size_t i = 0; i < kept.size(); ++i) x.row(static_cast<Eigen::Index>(i)) = kept[i].transpose();
  }
  if (faces.rows() == 0) return Issue{"cannot_read", {.file = name}, "every face is degenerate", "export the body again"};

  check_size(x, name, params, issues);
  if (params.winding == Winding::outward || params.wrap > 0) agree(faces);

  // Pieces, largest first.
  const std::vector<int> piece = piece_of_faces(faces, static_cast<int>(x.rows()));
  const int piece_count = 1 + *std::max_element(piece.begin(), piece.end());
  struct Part {
    int id;
    std::vector<int> faces;
    BodyPiece facts;
  };
  std::vector<Part> parts(static_cast<std::size_t>(piece_count));
  for (std::size_t f = 0; f < piece.size(); ++f) parts[static_cast<std::size_t>(piece[f])].faces.push_back(static_cast<int>(f));
  for (int i = 0; i < piece_count; ++i) {
    Part& part = parts[static_cast<std::size_t>(i)];
    part.id = i;
    mesh::Triangles own(static_cast<Eigen::Index>(part.faces.size()), 3);
    for (std::size_t k = 0; k < part.faces.size(); ++k) own.row(static_cast<Eigen::Index>(k)) = faces.row(part.faces[k]);
    std::vector<int> ids(own.data(), own.data() + own.size());
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    part.facts.vertices = static_cast<int>(ids.size());
    part.facts.faces = static_cast<int>(own.rows());
    Vector3d low = x.row(ids[0]), high = low;
    for (const int v : ids) {
      low = low.cwiseMin(x.row(v).transpose());
      high = high.cwiseMax(x.row(v).transpose());
    }
    // About the piece's own middle, so that an open piece's volume does not depend on where it stands.
    const Vector3d middle = (low + high) / 2;
    part.facts.volume = mesh::volume(x.rowwise() - middle.transpose(), own);
    if (params.winding == Winding::outward && part.facts.volume < 0) {
      for (const int f : part.faces) std::swap(faces(f, 1), faces(f, 2));
      part.facts.volume = -part.facts.volume;
    }
    part.facts.low = {low.x(), low.y(), low.z()};
    part.facts.high = {high.x(), high.y(), high.z()};
  }
  std::stable_sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return std::abs(a.facts.volume) > std::abs(b.facts.volume); });
  for (const Part& part : parts) body.pieces.push_back(part.facts);
  if (params.pieces == Pieces::largest) {
    mesh::Triangles own(static_cast<Eigen::Index>(parts[0].faces.size()), 3);
    std::vector<int> number(static_cast<std::size_t>(x.rows()), -1);
    mesh::Points3 points(parts[0].facts.vertices, 3);
    int next = 0;
    for (std::size_t k = 0; k < parts[0].faces.size(); ++k) {
      for (int c = 0; c < 3; ++c) {
        const int v = faces(parts[0].faces[k], c);
        int& n = number[static_cast<std::size_t>(v)];
        if (n < 0) {
          n = next++;
          points.row(n) = x.row(v);
        }
        own(static_cast<Eigen::Index>(k), c) = n;
      }
    }
    x = std::move(points);
    faces = std::move(own);
    std::vector<int> kept;
    for (const int f : parts[0].faces) kept.push_back(source[static_cast<std::size_t>(f)]);
    source = std::move(kept);
    parts.resize(1);
  }

  if (params.wrap > 0) {
    if (!issues.empty()) return issues;
    body.open_edges = open_edges(faces);
    geometry::Wrap closed = geometry::wrap(x, faces, params.wrap, params.wrap_offset);
    x = std::move(closed.x);
    faces = std::move(closed.faces);
    for (int& f : closed.nearest) f = source[static_cast<std::size_t>(f)];
    source = std::move(closed.nearest);
    check_wrap(x, faces, std::abs(parts[0].facts.volume), name, params, issues);
    body.wrap_distance = closed.farthest;
  } else {
    check_surface(x, faces, name, issues);
    const bool sound = std::none_of(issues.begin(), issues.end(), [](const Issue& i) { return i.code != "implausible_size"; });
    for (const Part& part : parts) {
      if (!sound || part.facts.volume > 0) continue;
      const Vector3d middle((part.facts.low[0] + part.facts.high[0]) / 2, (part.facts.low[1] + part.facts.high[1]) / 2, (part.facts.low[2] + part.facts.high[2]) / 2);
      issues.push_back(Issue{"inside_out", {.file = name}, fmt::format("the faces of the piece around {} ({} faces) look inward", place(middle), part.facts.faces),
                             "turn them, or ask for winding: outward"});
    }
  }
  if (!issues.empty()) return issues;
  if (params.standing == Standing::floor) x.col(1).array() -= x.col(1).minCoeff();

  body.mesh.x = std::move(x);
  body.mesh.faces = std::move(faces);
  body.mesh.face_region = mesh::Ids::Constant(body.mesh.faces.rows(), -1);
  issues = mesh::validate(body.mesh);
  if (issues.empty()) issues = name_regions(body.mesh, params, marks, source);
  for (Issue& issue : issues) issue.place.file = name;
  if (!issues.empty()) return issues;
  return body;
}

}  // namespace toile::io
