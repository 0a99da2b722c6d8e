#include "toile/reshape/flatten.h"

#include "cut_mesh.h"
#include "fields.h"
#include "unfold.h"

#include "toile/base/parallel.h"
#include "toile/base/text.h"
#include "toile/contact/distance.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace toile::reshape {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

Vector3d vec(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// A surface cut along lines, as it stands before the pieces are taken out.
struct Cutting {
  CutMesh mesh;
  std::vector<std::string> labels;  ///< of lines
  std::set<int> darts;              ///< lines that may end inside
};

/// A connected set of faces with its lines open.
struct Cloth {
  Points3 x;
  Triangles faces;
  std::vector<int> origin;  ///< vertex of the cut mesh, of each vertex
};

Cloth open_cloth(const CutMesh& mesh, const std::vector<int>& faces) {
  // Corners that are one vertex: those that hang together through edges that are no lines.
  const std::size_t n = 3 * faces.size();
  std::vector<std::size_t> root(n);
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  std::map<EdgeKey, std::pair<std::size_t, std::size_t>> open;  // edge -> corners at its lower and higher vertex
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto& face = mesh.faces[static_cast<std::size_t>(faces[f])];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = 3 * f + k, j = 3 * f + (k + 1) % 3;
      const EdgeKey edge = edge_key(face[k], face[(k + 1) % 3]);
      if (mesh.lines.count(edge)) continue;
      const auto corners = face[k] < face[(k + 1) % 3] ? std::pair{i, j} : std::pair{j, i};
      const auto [it, first] = open.emplace(edge, corners);
      if (first) continue;
      for (const auto& [a, b] : {std::pair{it->second.first, corners.first}, std::pair{it->second.second, corners.second}}) {
        const std::size_t p = find(a), q = find(b);
        root[std::max(p, q)] = std::min(p, q);
      }
    }
  }
  std::vector<std::pair<int, std::size_t>> order;  // by vertex, then by corner
  for (std::size_t i = 0; i < n; ++i) {
    if (find(i) == i) order.emplace_back(mesh.faces[static_cast<std::size_t>(faces[i / 3])][i % 3], i);
  }
  std::sort(order.begin(), order.end());
  std::map<std::size_t, int> id;
  Cloth cloth;
  cloth.x.resize(static_cast<Eigen::Index>(order.size()), 3);
  for (std::size_t v = 0; v < order.size(); ++v) {
    id[order[v].second] = static_cast<int>(v);
    cloth.origin.push_back(order[v].first);
    cloth.x.row(static_cast<Eigen::Index>(v)) = mesh.x[static_cast<std::size_t>(order[v].first)].transpose();
  }
  cloth.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t i = 0; i < n; ++i) cloth.faces(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3)) = id.at(find(i));
  return cloth;
}

struct Distortion {
  double area = 0, area_change = 0, largest = 0, rms = 0, stretch = 0, compression = 0;
  int turned = 0;
};
Distortion distortion(const Cloth& cloth, const Points2& uv) {
  Distortion d;
  const Points2 s = stretches(cloth.x, uv, cloth.faces);
  double flat = 0, sum = 0;
  for (Eigen::Index f = 0; f < cloth.faces.rows(); ++f) {
    const Vector3d a = cloth.x.row(cloth.faces(f, 0)), b = cloth.x.row(cloth.faces(f, 1)), c = cloth.x.row(cloth.faces(f, 2));
    const double area = 0.5 * (b - a).cross(c - a).norm();
    d.area += area;
    flat += area * s(f, 0) * s(f, 1);
    sum += area * ((s(f, 0) - 1) * (s(f, 0) - 1) + (s(f, 1) - 1) * (s(f, 1) - 1)) / 2;
    d.stretch = std::max(d.stretch, s(f, 0) - 1);
    d.compression = std::min(d.compression, s(f, 1) - 1);
    d.turned += s(f, 1) <= 0;
  }
  d.area_change = flat / d.area - 1;
  d.rms = std::sqrt(sum / d.area);
  d.largest = std::max(d.stretch, -d.compression);
  return d;
}

/// Turned so that the warp follows the grain, its lowest corner at the origin. Nothing where the grain stands on the piece.
std::optional<Points2> along_grain(const Cloth& cloth, const Points2& uv, const Vector3d& grain) {
  Vector2d sum = Vector2d::Zero();
  double area = 0;
  for (Eigen::Index f = 0; f < cloth.faces.rows(); ++f) {
    const Vector3d a = cloth.x.row(cloth.faces(f, 0));
    const Vector3d e = cloth.x.row(cloth.faces(f, 1)).transpose() - a, g = cloth.x.row(cloth.faces(f, 2)).transpose() - a;
    const Vector2d p = (uv.row(cloth.faces(f, 1)) - uv.row(cloth.faces(f, 0))).transpose(), q = (uv.row(cloth.faces(f, 2)) - uv.row(cloth.faces(f, 0))).transpose();
    const double twice = e.cross(g).norm();
    Eigen::Matrix2d gram;
    gram << e.dot(e), e.dot(g), e.dot(g), g.dot(g);
    const Vector2d c = gram.inverse() * Vector2d(e.dot(grain), g.dot(grain));
    sum += twice * (c[0] * p + c[1] * q);
    area += twice;
  }
  if (sum.norm() < 1e-3 * area * grain.norm()) return std::nullopt;
  sum.normalize();
  Points2 turned(uv.rows(), 2);
  for (Eigen::Index v = 0; v < uv.rows(); ++v) turned.row(v) << uv(v, 0) * sum.y() - uv(v, 1) * sum.x(), uv(v, 0) * sum.x() + uv(v, 1) * sum.y();
  const Eigen::RowVector2d low = turned.colwise().minCoeff();
  return Points2(turned.rowwise() - low);
}

struct Dart {
  int apex = 0, mouth = 0;  ///< vertices of the cloth
  DartProposal proposal;
};

/// Of darts from places inside to the nearest place of each stretch of the border the one that leaves the least strain.
std::optional<Dart> best_dart(const Cloth& cloth, const std::vector<std::vector<int>>& stretches_of_border, const std::vector<std::string>& names,
                              double longest, double rms_before) {
  std::set<int> border;
  for (const auto& row : stretches_of_border) border.insert(row.begin(), row.end());
  std::vector<int> apexes;  // spread evenly: each next one is the farthest from those before and from the border
  const std::vector<char> open(static_cast<std::size_t>(cloth.x.rows()), 1);
  std::vector<double> distance = edge_distances(cloth.x, cloth.faces, std::vector<int>(border.begin(), border.end()), open);
  for (int k = 0; k < 8; ++k) {
    const auto far = std::max_element(distance.begin(), distance.end());
    if (*far < 0.01) break;
    apexes.push_back(static_cast<int>(far - distance.begin()));
    const std::vector<double> own = edge_distances(cloth.x, cloth.faces, {apexes.back()}, open);
    for (std::size_t v = 0; v < distance.size(); ++v) distance[v] = std::min(distance[v], own[v]);
  }
  struct Trial {
    int apex, mouth;
    std::size_t stretch;
    double length;
  };
  std::vector<Trial> trials;
  for (const int apex : apexes) {
    const std::vector<double> own = edge_distances(cloth.x, cloth.faces, {apex}, open);
    for (std::size_t s = 0; s < stretches_of_border.size(); ++s) {
      const auto& row = stretches_of_border[s];
      Trial best{apex, -1, s, longest};
      for (std::size_t i = 1; i + 1 < row.size(); ++i) {
        const double d = own[static_cast<std::size_t>(row[i])];
        if (d < best.length) best.length = d, best.mouth = row[i];
      }
      if (best.mouth >= 0) trials.push_back(best);
    }
  }
  std::vector<std::optional<DartProposal>> results(trials.size());
  Surface surface{cloth.x, cloth.faces, Ids::Constant(cloth.faces.rows(), -1), {}, {}};
  parallel_for(trials.size(), 1, [&](std::size_t i) {
    CutMesh mesh(surface);
    mesh.held = {trials[i].apex, trials[i].mouth};
    if (mesh.cut_path(trials[i].apex, trials[i].mouth, 0) == 0) return;
    std::vector<int> all(mesh.faces.size());
    std::iota(all.begin(), all.end(), 0);
    const Cloth open_piece = open_cloth(mesh, all);
    if (mesh::euler_number(open_piece.faces) != 1 || mesh::border_loops(open_piece.faces).size() != 1) return;
    const Points2 uv = unfold(open_piece.x, open_piece.faces, 1e-5);
    const Distortion d = distortion(open_piece, uv);
    if (d.turned > 0) return;
    // Counter-clockwise the border runs from the mouth down one leg to the tip and up the other: the gap is on its right.
    const std::vector<int> loop = mesh::border_loops(open_piece.faces).front();
    const auto origin = [&](std::size_t k) { return open_piece.origin[static_cast<std::size_t>(loop[k % loop.size()])]; };
    const auto in_dart = [&](std::size_t k) { return mesh.lines.count(edge_key(origin(k), origin(k + 1))) > 0; };
    std::size_t start = 0;
    while (start < loop.size() && !(in_dart(start) && !in_dart(start + loop.size() - 1))) ++start;
    if (start == loop.size()) return;
    std::size_t count = 0;
    while (in_dart(start + count)) ++count;
    if (count != 2 * mesh.lines.size()) return;
    const auto place = [&](std::size_t k) { return Vector2d(uv.row(loop[(start + k) % loop.size()])); };
    const Vector2d down = (place(count / 2) - place(0)).normalized();
    for (std::size_t k = 0; k < count / 2; ++k) {
      const Vector2d across = place(count - k) - place(k);
      if (down.x() * across.y() - down.y() * across.x() > 1e-5) return;  // legs that overlap: there cloth is missing, not left over
    }
    DartProposal p;
    p.apex = mesh.x[static_cast<std::size_t>(trials[i].apex)];
    p.mouth = mesh.x[static_cast<std::size_t>(trials[i].mouth)];
    p.edge = names[trials[i].stretch];
    for (const auto& [edge, line] : mesh.lines) p.length += (mesh.x[static_cast<std::size_t>(edge.first)] - mesh.x[static_cast<std::size_t>(edge.second)]).norm();
    p.intake = (place(count) - place(0)).norm();
    p.rms_strain = d.rms;
    p.max_strain = d.largest;
    results[i] = p;
  });
  std::optional<Dart> best;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (!results[i] || results[i]->rms_strain >= (best ? best->proposal.rms_strain : 0.95 * rms_before)) continue;
    best = Dart{trials[i].apex, trials[i].mouth, *results[i]};
  }
  return best;
}

/// A stretch of a piece's border that is one edge of the pattern.
struct Stretch {
  std::string name;
  int line = -1;
  std::vector<int> row;  ///< vertices of the cloth, counter-clockwise
};

struct Piece {
  std::string name;
  Cloth cloth;
  Points2 uv;
  Distortion distortion;
  std::vector<Stretch> border;
};

Result<std::vector<Piece>> take_pieces(const Cutting& cutting, const std::map<std::string, Vector3d>& seeds, const FlattenParams& params) {
  const CutMesh& mesh = cutting.mesh;
  std::map<EdgeKey, std::vector<int>> beside;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) beside[edge_key(mesh.faces[f][k], mesh.faces[f][(k + 1) % 3])].push_back(static_cast<int>(f));
  }
  std::vector<int> component(mesh.faces.size(), -1);
  std::vector<std::vector<int>> members;
  for (std::size_t seed = 0; seed < mesh.faces.size(); ++seed) {
    if (component[seed] >= 0) continue;
    const int id = static_cast<int>(members.size());
    std::vector<int> row{static_cast<int>(seed)};
    component[seed] = id;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const auto& face = mesh.faces[static_cast<std::size_t>(row[i])];
      for (std::size_t k = 0; k < 3; ++k) {
        const EdgeKey edge = edge_key(face[k], face[(k + 1) % 3]);
        if (mesh.lines.count(edge)) continue;
        for (const int g : beside.at(edge)) {
          if (component[static_cast<std::size_t>(g)] >= 0) continue;
          component[static_cast<std::size_t>(g)] = id;
          row.push_back(g);
        }
      }
    }
    std::sort(row.begin(), row.end());
    members.push_back(std::move(row));
  }
  Issues issues;
  std::vector<Piece> pieces;
  std::map<int, std::string> taken;
  std::map<int, std::size_t> piece_of;  // component -> piece
  for (const auto& [name, seed] : seeds) {
    int best = -1;
    double best_sq = 0;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      const auto c = contact::closest_vertex_face(seed, mesh.x[static_cast<std::size_t>(mesh.faces[f][0])], mesh.x[static_cast<std::size_t>(mesh.faces[f][1])], mesh.x[static_cast<std::size_t>(mesh.faces[f][2])]);
      if (best >= 0 && c.distance_sq >= best_sq) continue;
      best = static_cast<int>(f), best_sq = c.distance_sq;
    }
    const int id = component[static_cast<std::size_t>(best)];
    const auto [it, first] = taken.emplace(id, name);
    if (!first) {
      issues.push_back({"not_separated", {.item = "pieces." + name}, fmt::format("no line separates it from the piece '{}'", it->second),
                        "lead the lines between the two farther, until they meet others, or leave one of the two out"});
      continue;
    }
    bool manifold = true;
    for (const int f : members[static_cast<std::size_t>(id)]) {
      const auto& face = mesh.faces[static_cast<std::size_t>(f)];
      for (std::size_t k = 0; k < 3; ++k) {
        const EdgeKey edge = edge_key(face[k], face[(k + 1) % 3]);
        if (!mesh.lines.count(edge) && beside.at(edge).size() > 2) manifold = false;
      }
    }
    if (!manifold) {
      issues.push_back({"not_a_disk", {.item = "pieces." + name}, "three and more panels meet in a seam inside it", "cut along that seam (`seam`)"});
      continue;
    }
    Piece piece;
    piece.name = name;
    piece.cloth = open_cloth(mesh, members[static_cast<std::size_t>(id)]);
    const std::size_t loops = mesh::border_loops(piece.cloth.faces).size();
    if (mesh::euler_number(piece.cloth.faces) != 1 || loops != 1) {
      issues.push_back({"not_a_disk", {.item = "pieces." + name},
                        loops == 0 ? std::string("it is closed: no line runs across it") : fmt::format("it cannot be laid flat in one piece: it has {} borders", loops),
                        "cut it open with a further line from border to border"});
      continue;
    }
    piece_of[id] = pieces.size();
    pieces.push_back(std::move(piece));
  }
  if (!issues.empty()) return issues;

  // Where edges of the pattern end: where lines meet, where another piece begins, at the tips of darts.
  std::map<int, int> degree;
  for (const auto& [edge, faces] : beside) {
    if (mesh.lines.count(edge) || faces.size() == 1) ++degree[edge.first], ++degree[edge.second];
  }
  std::set<int> ends;
  for (const auto& [v, d] : degree) {
    if (d != 2) ends.insert(v);
  }
  const auto line_of = [&](const EdgeKey& edge) {
    const auto found = mesh.lines.find(edge);
    return found == mesh.lines.end() ? -1 : found->second;
  };
  std::vector<std::vector<int>> loops;
  for (const Piece& piece : pieces) {
    const std::vector<int> loop = mesh::border_loops(piece.cloth.faces).front();
    loops.push_back(loop);
    const auto origin = [&](std::size_t i) { return piece.cloth.origin[static_cast<std::size_t>(loop[i % loop.size()])]; };
    for (std::size_t i = 0; i < loop.size(); ++i) {
      if (line_of(edge_key(origin(i + loop.size() - 1), origin(i))) != line_of(edge_key(origin(i), origin(i + 1)))) ends.insert(origin(i));
    }
  }
  for (bool more = true; more;) {
    more = false;
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      std::vector<int> own;
      for (const int v : loops[p]) {
        if (ends.count(pieces[p].cloth.origin[static_cast<std::size_t>(v)])) own.push_back(pieces[p].cloth.origin[static_cast<std::size_t>(v)]);
      }
      if (own.size() >= 2) continue;
      more = true;
      if (own.empty()) own.push_back(pieces[p].cloth.origin[static_cast<std::size_t>(*std::min_element(loops[p].begin(), loops[p].end()))]);
      ends.insert(own.front());
      int far = own.front();
      const auto off = [&](int v) { return (mesh.x[static_cast<std::size_t>(v)] - mesh.x[static_cast<std::size_t>(own.front())]).squaredNorm(); };
      for (const int v : loops[p]) {
        const int o = pieces[p].cloth.origin[static_cast<std::size_t>(v)];
        if (off(o) > off(far)) far = o;
      }
      ends.insert(far);
    }
  }
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    Piece& piece = pieces[p];
    const std::vector<int>& loop = loops[p];
    const auto origin = [&](std::size_t i) { return piece.cloth.origin[static_cast<std::size_t>(loop[i % loop.size()])]; };
    std::size_t start = 0;
    for (std::size_t i = 1; i < loop.size(); ++i) {
      const bool better = ends.count(origin(i)) && (!ends.count(origin(start)) || origin(i) < origin(start));
      if (better) start = i;
    }
    std::map<std::string, int> used;
    for (std::size_t i = start; i < start + loop.size(); ++i) {
      if (i == start || ends.count(origin(i))) {
        Stretch stretch;
        stretch.line = line_of(edge_key(origin(i), origin(i + 1)));
        stretch.name = stretch.line < 0 ? "border" : cutting.labels[static_cast<std::size_t>(stretch.line)];
        const int count = ++used[stretch.name];
        if (count > 1) stretch.name += fmt::format("_{}", count);
        stretch.row = {loop[i % loop.size()]};
        piece.border.push_back(std::move(stretch));
      }
      piece.border.back().row.push_back(loop[(i + 1) % loop.size()]);
    }
  }
  parallel_for(pieces.size(), 1, [&](std::size_t p) {
    pieces[p].uv = unfold(pieces[p].cloth.x, pieces[p].cloth.faces);
    pieces[p].distortion = distortion(pieces[p].cloth, pieces[p].uv);
  });
  for (Piece& piece : pieces) {
    auto turned = along_grain(piece.cloth, piece.uv, vec(params.pieces.at(piece.name).grain));
    if (!turned) {
      issues.push_back({"grain_across", {.item = "pieces." + piece.name + ".grain"}, "the grain stands on the piece or runs round it", "give a direction that lies in the piece"});
      continue;
    }
    piece.uv = std::move(*turned);
  }
  if (!issues.empty()) return issues;
  return pieces;
}

double row_length(const Points2& uv, const std::vector<int>& row, std::size_t to) {
  double length = 0;
  for (std::size_t i = 1; i <= to; ++i) length += (uv.row(row[i]) - uv.row(row[i - 1])).norm();
  return length;
}

std::string plain_name(std::string name) {
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-') c = '_';
  }
  return name;
}

Result<Flattened> flatten_cut(const Surface& surface, Cutting cutting, const std::map<std::string, std::vector<EdgeKey>>& seams, const FlattenParams& params) {
  Issues issues;
  CutMesh& mesh = cutting.mesh;
  std::map<std::string, Vector3d> points = surface.points;
  const auto resolve = [&](const std::string& name, const std::string& key) -> std::optional<Vector3d> {
    Surface known = {{}, {}, {}, {}, points};
    const auto found = find_point(known, name, {0, 0, 0}, key);
    if (found) return *found;
    append(issues, found.issues());
    return std::nullopt;
  };
  // Points may refer to one another in any order.
  std::set<std::string> waiting;
  for (const auto& [name, spec] : params.points) waiting.insert(name);
  for (bool progress = true; progress && !waiting.empty();) {
    progress = false;
    for (const auto& [name, spec] : params.points) {
      if (!waiting.count(name)) continue;
      const auto ready = [&](const std::string& other) { return !waiting.count(other); };
      if (!(spec.between.empty() ? spec.at.empty() || ready(spec.at) : ready(spec.between[0]) && ready(spec.between[1]))) continue;
      std::optional<Vector3d> p;
      if (spec.between.empty()) {
        const auto base = spec.at.empty() ? Vector3d::Zero().eval() : resolve(spec.at, "points." + name + ".at");
        if (base) p = *base + vec(spec.shift);
      } else {
        const auto a = resolve(spec.between[0], "points." + name + ".between"), b = resolve(spec.between[1], "points." + name + ".between");
        if (a && b) p = *a + spec.fraction * (*b - *a) + vec(spec.shift);
      }
      if (p) {
        const SurfacePoint near = nearest(surface.x, surface.faces, *p);
        points[name] = at(surface.x, surface.faces, near);
      }
      waiting.erase(name);
      progress = true;
    }
  }
  for (const std::string& name : waiting) issues.push_back({"unknown_point", {.item = "points." + name}, "it is given by points that are given by it", "begin at a point of the surface"});
  std::map<std::string, Vector3d> seeds;
  for (const auto& [name, spec] : params.pieces) {
    if (const auto p = resolve(spec.at, "pieces." + name + ".at")) seeds[name] = *p;
  }
  for (const CutSpec& cut : params.cuts) {
    for (const std::string& point : cut.plane) resolve(point, "cuts." + cut.name + ".plane");
    for (const std::string& point : cut.path) resolve(point, "cuts." + cut.name + ".path");
    if (!cut.seam.empty() && !seams.count(cut.seam)) {
      std::vector<std::string> names;
      for (const auto& [name, edges] : seams) names.push_back(name);
      issues.push_back({"unknown_seam", {.item = "cuts." + cut.name + ".seam"}, fmt::format("the surface has no seam '{}'", cut.seam),
                        names.empty() ? std::string("only garments have seams: give a plane or a path") : suggestion(cut.seam, names)});
    }
    const auto keep = faces_of(surface, cut.parts, "cuts." + cut.name + ".parts");
    if (!keep) append(issues, keep.issues());
  }
  if (!issues.empty()) return issues;

  std::map<std::string, int> vertex;
  for (const CutSpec& cut : params.cuts) {
    const int line = static_cast<int>(cutting.labels.size());
    cutting.labels.push_back(cut.name);
    if (cut.dart) cutting.darts.insert(line);
    const std::string key = "cuts." + cut.name;
    if (!cut.seam.empty()) {
      // An edge that lines cut before is two by now; both halves lie on the way between its ends.
      for (const EdgeKey& edge : seams.at(cut.seam)) mesh.lines[edge] = line;
    } else if (!cut.plane.empty()) {
      std::vector<Vector3d> p;
      for (const std::string& name : cut.plane) p.push_back(points.at(name));
      Vector3d normal = vec(cut.normal);
      if (p.size() == 2) normal = (p[1] - p[0]).cross(vec(cut.along));
      if (p.size() == 3) normal = (p[1] - p[0]).cross(p[2] - p[0]);
      std::vector<char> keep;
      if (!cut.parts.empty()) {
        keep.assign(surface.parts.size() + 1, 0);
        for (std::size_t i = 0; i < surface.parts.size(); ++i) keep[i + 1] = std::find(cut.parts.begin(), cut.parts.end(), surface.parts[i]) != cut.parts.end();
      }
      if (!(normal.norm() > 1e-9)) {
        issues.push_back({"no_section", {.item = key}, "its points lie on a line and span no plane", "name other points, or another direction"});
      } else if (mesh.cut_plane(p[0], normal.normalized(), keep, line) == 0) {
        issues.push_back({"no_section", {.item = key}, "its plane does not meet the surface", "check its points, its normal and `parts`"});
      }
    } else {
      for (const std::string& name : cut.path) {
        if (vertex.count(name)) continue;
        vertex[name] = mesh.insert_point(points.at(name), params.snap);
        mesh.names.emplace(vertex[name], plain_name(name));
      }
      for (std::size_t i = 1; i < cut.path.size(); ++i) {
        if (vertex.at(cut.path[i - 1]) == vertex.at(cut.path[i]) || mesh.cut_path(vertex.at(cut.path[i - 1]), vertex.at(cut.path[i]), line) == 0) {
          issues.push_back({"no_path", {.item = key}, fmt::format("no way leads straight over the surface from '{}' to '{}'", cut.path[i - 1], cut.path[i]), "set a further point between the two"});
        }
      }
    }
  }
  if (!issues.empty()) return issues;

  // Ends that hang over are left off.
  {
    std::map<EdgeKey, int> faces_at;
    for (const auto& face : mesh.faces) {
      for (std::size_t k = 0; k < 3; ++k) ++faces_at[edge_key(face[k], face[(k + 1) % 3])];
    }
    std::map<int, std::set<EdgeKey>> at_vertex;
    std::set<int> border;
    std::map<int, int> edges_of;
    for (const auto& [edge, line] : mesh.lines) {
      at_vertex[edge.first].insert(edge), at_vertex[edge.second].insert(edge);
      ++edges_of[line];
    }
    for (const auto& [edge, count] : faces_at) {
      if (count == 1) border.insert({edge.first, edge.second});
    }
    std::vector<int> queue;
    for (const auto& [v, edges] : at_vertex) queue.push_back(v);
    while (!queue.empty()) {
      const int v = queue.back();
      queue.pop_back();
      auto& edges = at_vertex[v];
      if (edges.size() != 1 || border.count(v)) continue;
      const EdgeKey edge = *edges.begin();
      const int line = mesh.lines.at(edge), other = edge.first == v ? edge.second : edge.first;
      if (cutting.darts.count(line)) continue;
      mesh.lines.erase(edge);
      --edges_of[line];
      edges.clear();
      at_vertex[other].erase(edge);
      queue.push_back(other);
    }
    for (std::size_t line = 0; line < cutting.labels.size(); ++line) {
      const auto found = edges_of.find(static_cast<int>(line));
      if (found == edges_of.end() || found->second > 0) continue;
      issues.push_back({"loose_cut", {.item = "cuts." + cutting.labels[line]}, "it ends inside the surface: nothing is separated by it",
                        "lead it from one line or border to another, or say `dart: true`"});
    }
    if (!issues.empty()) return issues;
  }

  Flattened result;
  TOILE_TRY(std::vector<Piece> pieces, take_pieces(cutting, seeds, params));
  std::map<std::string, DartProposal> proposals;
  std::map<std::string, int> cut_darts;
  for (int round = 0; params.darts != Darts::none && round < 4; ++round) {
    bool changed = false;
    for (const Piece& piece : pieces) {
      if (piece.distortion.largest <= params.limit) {
        proposals.erase(piece.name);
        continue;
      }
      std::vector<std::vector<int>> rows;
      std::vector<std::string> names;
      for (const Stretch& stretch : piece.border) {
        if (stretch.line >= 0 && cutting.darts.count(stretch.line)) continue;
        rows.push_back(stretch.row);
        names.push_back(stretch.name);
      }
      const auto dart = best_dart(piece.cloth, rows, names, params.dart_length, piece.distortion.rms);
      proposals.erase(piece.name);
      if (!dart) continue;
      proposals[piece.name] = dart->proposal;
      if (params.darts != Darts::cut || round == 3) continue;
      const int line = static_cast<int>(cutting.labels.size());
      const int apex = piece.cloth.origin[static_cast<std::size_t>(dart->apex)], mouth = piece.cloth.origin[static_cast<std::size_t>(dart->mouth)];
      mesh.held.insert({apex, mouth});
      cutting.labels.push_back(fmt::format("dart_{}", ++cut_darts[piece.name]));
      cutting.darts.insert(line);
      changed = mesh.cut_path(apex, mouth, line) > 0 || changed;
    }
    if (!changed) break;
    TOILE_TRY(pieces, take_pieces(cutting, seeds, params));
  }

  result.pattern.name = params.name;
  result.pattern.origin = "laid flat by toile-flatten";
  mesh::GarmentMesh& map = result.map;
  struct Side {
    std::size_t piece, stretch;
  };
  std::map<std::pair<int, int>, Side> sides;  // directed edge of the cut mesh -> where it is an edge of the pattern
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    for (std::size_t s = 0; s < pieces[p].border.size(); ++s) {
      const auto& row = pieces[p].border[s].row;
      const auto& origin = pieces[p].cloth.origin;
      sides[{origin[static_cast<std::size_t>(row[0])], origin[static_cast<std::size_t>(row[1])]}] = {p, s};
    }
  }
  std::vector<std::vector<std::vector<std::pair<std::string, double>>>> notches(pieces.size());
  for (std::size_t p = 0; p < pieces.size(); ++p) notches[p].resize(pieces[p].border.size());
  std::map<std::string, int> seam_count;
  struct Mate {
    Side a, b;
    std::size_t seam;
  };
  std::vector<Mate> mates;
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    for (std::size_t s = 0; s < pieces[p].border.size(); ++s) {
      const Stretch& stretch = pieces[p].border[s];
      const auto origin = [&](std::size_t i) { return pieces[p].cloth.origin[static_cast<std::size_t>(stretch.row[i])]; };
      const std::size_t last = stretch.row.size() - 1;
      // The other side runs the other way: it starts with this one's last edge, reversed.
      const auto found = sides.find({origin(last), origin(last - 1)});
      if (found == sides.end() || std::pair(found->second.piece, found->second.stretch) < std::pair(p, s)) continue;
      const Piece& other = pieces[found->second.piece];
      const Stretch& mate = other.border[found->second.stretch];
      if (mate.row.size() != stretch.row.size()) continue;
      SeamRow seam;
      const std::string label = cutting.labels[static_cast<std::size_t>(stretch.line)];
      seam.kind = cutting.darts.count(stretch.line) && found->second.piece == p ? "dart" : "plain";
      seam.name = seam.kind == "dart" ? pieces[p].name + "_" + label : label;
      if (const int count = ++seam_count[seam.name]; count > 1) seam.name += fmt::format("_{}", count);
      seam.a_piece = pieces[p].name, seam.a_edge = stretch.name, seam.b_piece = other.name, seam.b_edge = mate.name;
      seam.length_a = row_length(pieces[p].uv, stretch.row, last);
      seam.length_b = row_length(other.uv, mate.row, last);
      if (params.notch_every > 0 && seam.kind != "dart") {
        double length = 0;
        std::vector<double> along{0};
        for (std::size_t i = 1; i <= last; ++i) along.push_back(length += (mesh.x[static_cast<std::size_t>(origin(i))] - mesh.x[static_cast<std::size_t>(origin(i - 1))]).norm());
        const int parts = std::min(static_cast<int>(std::ceil(length / params.notch_every - 1e-9)), static_cast<int>(last) / 2);
        std::size_t before = 0;
        for (int k = 1; k < parts; ++k) {
          std::size_t i = 1;
          while (i + 1 < last && std::abs(along[i + 1] - length * k / parts) < std::abs(along[i] - length * k / parts)) ++i;
          if (i == before || i == 0 || i == last) continue;
          before = i;
          const std::string name = fmt::format("{}_n{}", seam.name, k);
          seam.notches.push_back(name);
          notches[p][s].emplace_back(name, row_length(pieces[p].uv, stretch.row, i) / seam.length_a);
          notches[found->second.piece][found->second.stretch].emplace_back(found->second.piece == p ? name + "_b" : name, row_length(other.uv, mate.row, last - i) / seam.length_b);
        }
      }
      mates.push_back({{p, s}, found->second, result.seams.size()});
      result.seams.push_back(std::move(seam));
    }
  }

  const auto mm = [](const Eigen::RowVector2d& p) { return Vector2d(std::round(p.x() * 1e6) / 1e3, std::round(p.y() * 1e6) / 1e3); };
  std::vector<int> first_vertex;
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const Piece& piece = pieces[p];
    const PieceSpec& spec = params.pieces.at(piece.name);
    pattern::Piece drawn;
    drawn.name = piece.name;
    drawn.material = spec.material;
    if (spec.allowance > 0) drawn.allowance = 1e3 * spec.allowance;
    std::map<int, std::string> corner;  // vertex of the cloth -> name
    std::set<std::string> used;
    int number = 0;
    for (const Stretch& stretch : piece.border) {
      const int v = stretch.row.front();
      const auto named = mesh.names.find(piece.cloth.origin[static_cast<std::size_t>(v)]);
      std::string name = named != mesh.names.end() ? named->second : fmt::format("c{}", ++number);
      const std::string stem = name;
      for (int k = 2; !used.insert(name).second; ++k) name = fmt::format("{}_{}", stem, k);
      corner[v] = name;
      drawn.points[name] = mm(piece.uv.row(v));
    }
    for (std::size_t s = 0; s < piece.border.size(); ++s) {
      const Stretch& stretch = piece.border[s];
      std::vector<Vector2d> row;
      for (const int v : stretch.row) row.push_back(mm(piece.uv.row(v)));
      pattern::Edge edge{stretch.name, corner.at(stretch.row.front()), corner.at(stretch.row.back()), fit_curves(row, 1e3 * params.fit), {}};
      for (pattern::Segment& segment : edge.segments) {
        segment.control_1 = mm(1e-3 * segment.control_1.transpose());
        segment.control_2 = mm(1e-3 * segment.control_2.transpose());
      }
      drawn.outline.push_back(std::move(edge));
      for (const auto& [name, fraction] : notches[p][s]) drawn.notches.push_back({name, stretch.name, {}, {}, std::round(1e6 * fraction) / 1e6});
    }
    const Eigen::RowVector2d high = piece.uv.colwise().maxCoeff();
    drawn.grain = pattern::Grain{mm(Eigen::RowVector2d(0.5 * high.x(), 0.25 * high.y())), mm(Eigen::RowVector2d(0.5 * high.x(), 0.75 * high.y()))};
    result.pattern.pieces.push_back(std::move(drawn));

    PieceReport report{piece.name, piece.distortion.area, piece.distortion.area_change, piece.distortion.largest, piece.distortion.rms,
                       piece.distortion.stretch, piece.distortion.compression, piece.distortion.turned, 0, {}};
    if (const auto found = cut_darts.find(piece.name); found != cut_darts.end()) report.darts_cut = found->second;
    if (const auto found = proposals.find(piece.name); found != proposals.end()) report.dart = found->second;
    if (report.max_strain > params.limit) {
      result.findings.push_back({"strain", {.item = "pieces." + piece.name}, fmt::format("its largest strain {:.2f} % is over {:.2f} %", 100 * report.max_strain, 100 * params.limit),
                                 report.dart ? fmt::format("a dart of {:.0f} mm from '{}' with {:.1f} mm intake brings it to {:.2f} % (`darts: cut` cuts it), or set a further line, or a larger limit",
                                                           1e3 * report.dart->length, report.dart->edge, 1e3 * report.dart->intake, 100 * report.dart->max_strain)
                                             : std::string("set a further line through it, or a larger limit"),
                                 Category::check});
    }
    if (report.turned_faces > 0) {
      result.findings.push_back({"turned_over", {.item = "pieces." + piece.name}, fmt::format("{} faces are turned over in the plane", report.turned_faces),
                                 "set a further line through it", Category::check});
    }
    result.pieces.push_back(std::move(report));

    // The map.
    const int base = static_cast<int>(map.vertex_count()), first_face = static_cast<int>(map.face_count()), id = static_cast<int>(p);
    first_vertex.push_back(base);
    const Eigen::Index nv = piece.cloth.x.rows(), nf = piece.cloth.faces.rows();
    map.x.conservativeResize(base + nv, 3);
    map.uv.conservativeResize(base + nv, 2);
    map.vertex_panel.conservativeResize(base + nv);
    map.faces.conservativeResize(first_face + nf, 3);
    map.face_panel.conservativeResize(first_face + nf);
    map.face_laminate.conservativeResize(first_face + nf);
    map.x.bottomRows(nv) = piece.cloth.x;
    map.uv.bottomRows(nv) = piece.uv;
    map.vertex_panel.tail(nv).setConstant(id);
    map.faces.bottomRows(nf) = piece.cloth.faces.array() + base;
    map.face_panel.tail(nf).setConstant(id);
    map.face_laminate.tail(nf).setConstant(-1);
    const double flat_area = piece.distortion.area * (1 + piece.distortion.area_change);
    const double cell = std::sqrt(2 * flat_area / static_cast<double>(nf));
    map.panels.push_back({.id = id, .name = piece.name, .piece = piece.name, .material = spec.material, .cell_warp = cell, .cell_weft = cell, .cut_area = flat_area});
    for (const Stretch& stretch : piece.border) {
      const int run = static_cast<int>(map.runs.size());
      const double length = row_length(piece.uv, stretch.row, stretch.row.size() - 1);
      map.runs.push_back({run, id, stretch.name, length, false, false, spec.allowance});
      double s = 0;
      for (std::size_t i = 0; i < stretch.row.size(); ++i) {
        if (i > 0) s += (piece.uv.row(stretch.row[i]) - piece.uv.row(stretch.row[i - 1])).norm();
        map.run_vertices.push_back({run, base + stretch.row[i], i + 1 == stretch.row.size() ? length : s});
      }
    }
    for (const auto& [v, name] : corner) map.points.push_back({id, name, base + v});
  }
  for (const Mate& mate : mates) {
    const SeamRow& row = result.seams[mate.seam];
    mesh::Seam seam;
    seam.id = static_cast<int>(map.seams.size());
    seam.name = row.name;
    seam.kind = row.kind;
    seam.length_a = row.length_a;
    seam.length_b = row.length_b;
    map.seams.push_back(seam);
    const auto& a = pieces[mate.a.piece].border[mate.a.stretch].row;
    const auto& b = pieces[mate.b.piece].border[mate.b.stretch].row;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const int va = first_vertex[mate.a.piece] + a[i], vb = first_vertex[mate.b.piece] + b[b.size() - 1 - i];
      if (va != vb) map.welds.push_back({va, vb, seam.id});
    }
  }
  append(issues, pattern::check(result.pattern));
  if (!issues.empty()) return issues;
  return result;
}

}  // namespace

Result<Flattened> flatten(const Surface& surface, const FlattenParams& params) { return flatten_cut(surface, {CutMesh(surface), {}, {}}, {}, params); }

Result<Flattened> flatten(const mesh::GarmentMesh& garment, const FlattenParams& params) {
  const GarmentSurface whole = surface_of(garment);
  Cutting cutting{CutMesh(whole.surface), {}, {}};
  // Borders keep the names of their edges.
  std::map<EdgeKey, int> faces_at;
  for (const auto& face : cutting.mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) ++faces_at[edge_key(face[k], face[(k + 1) % 3])];
  }
  for (std::size_t i = 0; i + 1 < garment.run_vertices.size(); ++i) {
    const mesh::RunVertex &a = garment.run_vertices[i], &b = garment.run_vertices[i + 1];
    if (a.run != b.run) continue;
    const EdgeKey edge = edge_key(whole.particle[a.vertex], whole.particle[b.vertex]);
    const auto found = faces_at.find(edge);
    if (found == faces_at.end() || found->second != 1) continue;
    const std::string& name = garment.runs[static_cast<std::size_t>(a.run)].name;
    auto label = std::find(cutting.labels.begin(), cutting.labels.end(), name);
    if (label == cutting.labels.end()) label = cutting.labels.insert(label, name);
    cutting.mesh.lines.emplace(edge, static_cast<int>(label - cutting.labels.begin()));
  }
  std::map<std::string, std::vector<EdgeKey>> seams;
  const std::vector<mesh::Edge> edges = mesh::edges(garment.faces);
  for (const mesh::Seam& seam : garment.seams) {
    std::set<int> members;
    for (const mesh::Weld& weld : garment.welds) {
      if (weld.seam == seam.id) members.insert({weld.a, weld.b});
    }
    std::set<EdgeKey> found;
    for (const mesh::Edge& edge : edges) {
      if (edge.faces.size() == 1 && members.count(edge.a) && members.count(edge.b)) found.insert(edge_key(whole.particle[edge.a], whole.particle[edge.b]));
    }
    seams[seam.name].assign(found.begin(), found.end());
  }
  // Seams are cut first: later lines split their edges and keep their mark.
  FlattenParams ordered = params;
  std::stable_sort(ordered.cuts.begin(), ordered.cuts.end(), [](const CutSpec& a, const CutSpec& b) { return !a.seam.empty() && b.seam.empty(); });
  return flatten_cut(whole.surface, std::move(cutting), seams, ordered);
}

std::string seam_spec(const std::vector<SeamRow>& seams) {
  std::string text = seams.empty() ? "seams: []\n" : "seams:\n";
  for (const SeamRow& seam : seams) {
    text += fmt::format("  - {{name: {}, kind: {}, a: [{}.{}], b: [-{}.{}]", seam.name, seam.kind, seam.a_piece, seam.a_edge, seam.b_piece, seam.b_edge);
    const double difference = std::abs(seam.length_a - seam.length_b);
    if (difference > 4e-4) text += fmt::format(", ease: {:.2f} mm", 1e3 * difference + 0.5);
    if (!seam.notches.empty()) {
      text += ", match: [";
      for (std::size_t i = 0; i < seam.notches.size(); ++i) {
        text += fmt::format("{}{{a: {}.{}, b: {}.{}{}}}", i ? ", " : "", seam.a_piece, seam.notches[i], seam.b_piece, seam.notches[i], seam.a_piece == seam.b_piece ? "_b" : "");
      }
      text += "]";
    }
    text += "}\n";
  }
  return text;
}

Result<Points3> positions_from(const mesh::GarmentMesh& map, const mesh::GarmentMesh& garment) {
  Issues issues;
  std::vector<std::vector<int>> faces(garment.panels.size());
  for (const mesh::Panel& panel : garment.panels) {
    const auto found = std::find_if(map.panels.begin(), map.panels.end(), [&](const mesh::Panel& p) { return p.name == panel.name; });
    if (found == map.panels.end()) {
      std::vector<std::string> names;
      for (const mesh::Panel& p : map.panels) names.push_back(p.name);
      issues.push_back({"unknown_panel", {.item = panel.name}, "the map has no such panel", suggestion(panel.name, names)});
      continue;
    }
    for (int f = 0; f < map.face_count(); ++f) {
      if (map.face_panel[f] == found->id) faces[static_cast<std::size_t>(panel.id)].push_back(f);
    }
  }
  if (!issues.empty()) return issues;
  Points3 x(garment.vertex_count(), 3);
  parallel_for(static_cast<std::size_t>(garment.vertex_count()), 64, [&](std::size_t i) {
    const auto v = static_cast<Eigen::Index>(i);
    const Vector3d p(garment.uv(v, 0), garment.uv(v, 1), 0);
    int best = -1;
    double best_sq = 0;
    for (const int f : faces[static_cast<std::size_t>(garment.vertex_panel[v])]) {
      const auto corner = [&](int k) { return Vector3d(map.uv(map.faces(f, k), 0), map.uv(map.faces(f, k), 1), 0); };
      const auto c = contact::closest_vertex_face(p, corner(0), corner(1), corner(2));
      if (best >= 0 && c.distance_sq >= best_sq) continue;
      best = f, best_sq = c.distance_sq;
    }
    // Beside the map (a curve bulges) the nearest face goes on.
    const auto corner = [&](int k) { return Vector2d(map.uv.row(map.faces(best, k))); };
    Eigen::Matrix2d frame;
    frame << corner(1) - corner(0), corner(2) - corner(0);
    const Vector2d w = frame.inverse() * (p.head<2>() - corner(0));
    x.row(v) = (1 - w[0] - w[1]) * map.x.row(map.faces(best, 0)) + w[0] * map.x.row(map.faces(best, 1)) + w[1] * map.x.row(map.faces(best, 2));
  });
  return x;
}

}  // namespace toile::reshape
