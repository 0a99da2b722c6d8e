#include "body_regions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <queue>
#include <set>
#include <string>
#include <utility>

namespace toile::io {

using Eigen::Vector3d;

namespace {

/// Point of a triangle nearest to p.
Vector3d nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const auto on_edge = [&p](const Vector3d& u, const Vector3d& v) -> Vector3d {
    const Vector3d along = v - u;
    const double square = along.squaredNorm();
    return square > 0 ? Vector3d(u + std::clamp((p - u).dot(along) / square, 0.0, 1.0) * along) : u;
  };
  const Vector3d normal = (b - a).cross(c - a);
  if (normal.squaredNorm() > 0) {
    const Vector3d foot = p - (p - a).dot(normal) / normal.squaredNorm() * normal;
    const auto left_of = [&](const Vector3d& u, const Vector3d& v) { return (v - u).cross(foot - u).dot(normal) >= 0; };
    if (left_of(a, b) && left_of(b, c) && left_of(c, a)) return foot;
  }
  Vector3d best = on_edge(a, b);
  for (const Vector3d& q : {on_edge(b, c), on_edge(c, a)}) {
    if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
  }
  return best;
}

int color_distance(int a, int b) {
  int most = 0;
  for (const int shift : {0, 8, 16}) most = std::max(most, std::abs((a >> shift & 255) - (b >> shift & 255)));
  return most;
}

/// Lengths of the shortest ways along edges from a set of vertices [m].
std::vector<double> distances(const mesh::SupportMesh& body, const std::vector<std::vector<int>>& neighbours, const std::vector<int>& from) {
  std::vector<double> length(static_cast<std::size_t>(body.x.rows()), std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  for (const int v : from) {
    length[static_cast<std::size_t>(v)] = 0;
    open.emplace(0.0, v);
  }
  while (!open.empty()) {
    const auto [d, v] = open.top();
    open.pop();
    if (d > length[static_cast<std::size_t>(v)]) continue;
    for (const int w : neighbours[static_cast<std::size_t>(v)]) {
      const double way = d + (body.x.row(v) - body.x.row(w)).norm();
      if (way >= length[static_cast<std::size_t>(w)]) continue;
      length[static_cast<std::size_t>(w)] = way;
      open.emplace(way, w);
    }
  }
  return length;
}

/// Whatever the file calls its parts, for a message.
std::string part_names(const FaceMarks& marks) {
  std::set<std::string> names;
  for (const auto& part : marks.parts) names.insert(part.begin(), part.end());
  names.erase("");
  std::string text;
  int count = 0;
  for (const std::string& name : names) {
    if (++count <= 12) text += (text.empty() ? "" : ", ") + name;
  }
  if (count == 0) return "the file names none";
  return "the file has " + text + (count > 12 ? ", …" : "");
}

}  // namespace

Issues name_regions(mesh::SupportMesh& body, const BodyImportParams& params, const FaceMarks& marks, const std::vector<int>& source) {
  Issues issues;
  std::map<std::string, int> vertex_of;  // nearest to each landmark
  for (const auto& [name, at] : params.landmarks) {
    const Vector3d p(at[0], at[1], at[2]);
    Vector3d best = body.x.row(0);
    int vertex = 0;
    for (Eigen::Index f = 0; f < body.faces.rows(); ++f) {
      const Vector3d q = nearest_on_triangle(p, body.x.row(body.faces(f, 0)), body.x.row(body.faces(f, 1)), body.x.row(body.faces(f, 2)));
      if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
    }
    (body.x.rowwise() - best.transpose()).rowwise().squaredNorm().minCoeff(&vertex);
    const double off = (best - p).norm();
    if (!(off <= params.landmark_tolerance)) {
      issues.push_back(Issue{"off_surface", {.item = "landmarks." + name}, fmt::format("lies {:.1f} mm from the surface, whose nearest point is ({:.4f}, {:.4f}, {:.4f}) m", 1000 * off, best.x(), best.y(), best.z()),
                             "give a point of the result (metres, y up, facing +z), or raise landmark_tolerance"});
    }
    body.landmarks[name] = {best.x(), best.y(), best.z()};
    vertex_of[name] = vertex;
  }

  const auto region_of = [&body](const std::string& name) {
    const auto it = std::find(body.region_names.begin(), body.region_names.end(), name);
    if (it != body.region_names.end()) return static_cast<int>(it - body.region_names.begin());
    body.region_names.push_back(name);
    return static_cast<int>(body.region_names.size()) - 1;
  };
  const auto mark_of = [&source](const std::vector<int>& of_face, Eigen::Index f) { return of_face.empty() ? -1 : of_face[static_cast<std::size_t>(source[static_cast<std::size_t>(f)])]; };
  for (const BodyRegion& region : params.regions) {
    const int id = region_of(region.name);
    if (!region.landmarks.empty()) continue;
    const int color = region.color.empty() ? -1 : std::stoi(region.color, nullptr, 16);
    int found = 0;
    for (Eigen::Index f = 0; f < body.faces.rows(); ++f) {
      bool in = false;
      if (!region.box.empty()) {
        const Vector3d middle = (body.x.row(body.faces(f, 0)) + body.x.row(body.faces(f, 1)) + body.x.row(body.faces(f, 2))).transpose() / 3;
        in = true;
        for (int k = 0; k < 3; ++k) in = in && middle[k] >= region.box[static_cast<std::size_t>(k)] && middle[k] <= region.box[static_cast<std::size_t>(k) + 3];
      } else if (!region.part.empty()) {
        const int part = mark_of(marks.part, f);
        if (part < 0) continue;
        const auto& names = marks.parts[static_cast<std::size_t>(part)];
        in = std::find(names.begin(), names.end(), region.part) != names.end();
      } else {
        const int own = mark_of(marks.color, f);
        in = own >= 0 && color_distance(own, color) <= 2;
      }
      if (!in) continue;
      body.face_region[f] = id;
      ++found;
    }
    if (found > 0) continue;
    if (!region.box.empty()) {
      const Vector3d low = body.x.colwise().minCoeff(), high = body.x.colwise().maxCoeff();
      issues.push_back(Issue{"empty_region", {.item = "regions." + region.name}, "no face has its middle in the box",
                             fmt::format("give a box in metres; the body reaches from ({:.3f}, {:.3f}, {:.3f}) to ({:.3f}, {:.3f}, {:.3f})", low.x(), low.y(), low.z(), high.x(), high.y(), high.z())});
    } else if (!region.part.empty()) {
      issues.push_back(Issue{"empty_region", {.item = "regions." + region.name}, "no face belongs to a part '" + region.part + "'", "name an object, group or material: " + part_names(marks)});
    } else {
      issues.push_back(Issue{"empty_region", {.item = "regions." + region.name}, "no face is painted '" + region.color + "'",
                             "check the colour; it has to be a colour of vertices, in a format that keeps them (PLY, glTF, OBJ)"});
    }
  }

  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(body.x.rows()));
  for (Eigen::Index f = 0; f < body.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) neighbours[static_cast<std::size_t>(body.faces(f, k))].push_back(body.faces(f, (k + 1) % 3));  // closed: the other way comes from the other face
  }
  std::vector<std::pair<int, std::vector<double>>> ways;  // region, distance of each vertex from its landmarks
  for (const BodyRegion& region : params.regions) {
    if (region.landmarks.empty()) continue;
    std::vector<int> from;
    for (const std::string& name : region.landmarks) {
      const auto it = vertex_of.find(name);
      if (it == vertex_of.end()) {
        issues.push_back(Issue{"unknown_landmark", {.item = "regions." + region.name}, "there is no landmark '" + name + "'", "give its place in `landmarks`"});
      } else {
        from.push_back(it->second);
      }
    }
    ways.emplace_back(region_of(region.name), distances(body, neighbours, from));
  }
  if (!issues.empty()) return issues;
  for (Eigen::Index f = 0; f < body.faces.rows(); ++f) {
    if (body.face_region[f] >= 0) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [id, length] : ways) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += length[static_cast<std::size_t>(body.faces(f, k))];
      if (sum >= least) continue;
      least = sum;
      body.face_region[f] = id;
    }
  }
  return issues;
}

}  // namespace toile::io
