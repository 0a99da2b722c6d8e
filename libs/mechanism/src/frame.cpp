#include "toile/mechanism/frame.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace toile::mechanism {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

struct Surface {
  std::vector<Vector3d> points;
  std::vector<std::array<int, 3>> faces;
  std::vector<int> region;

  /// Rings of equally many points along a line, joined and closed by fans at both ends. A ring runs counter-clockwise seen from the line's far end.
  void add_tube(const std::vector<std::vector<Vector3d>>& rings, int body) {
    const int base = static_cast<int>(points.size()), sides = static_cast<int>(rings.front().size()), count = static_cast<int>(rings.size());
    for (const auto& ring : rings) points.insert(points.end(), ring.begin(), ring.end());
    const auto at = [&](int ring, int k) { return base + ring * sides + k % sides; };
    const auto add = [&](int a, int b, int c) {
      faces.push_back({a, b, c});
      region.push_back(body);
    };
    for (int r = 0; r + 1 < count; ++r) {
      for (int k = 0; k < sides; ++k) {
        add(at(r, k), at(r, k + 1), at(r + 1, k + 1));
        add(at(r, k), at(r + 1, k + 1), at(r + 1, k));
      }
    }
    for (int k = 1; k + 1 < sides; ++k) {
      add(at(0, 0), at(0, k + 1), at(0, k));
      add(at(count - 1, 0), at(count - 1, k), at(count - 1, k + 1));
    }
  }
};

/// The section of a bow at u, from -1 (right end) to 1.
struct Section {
  Vector3d centre, thick, wide;  ///< unit: square to the section's width, outwards; along its width
};

Section section(const Bow& bow, double u) {
  const double x = u * bow.half_width, drop = bow.crown * std::pow(std::abs(u), bow.exponent);
  const double slope = -bow.crown * bow.exponent * std::pow(std::abs(u), bow.exponent - 1) / bow.half_width * (u < 0 ? -1 : 1);
  // Square to the arch, outwards; and along the car, turned by the pitch about it.
  const Vector3d along = Vector3d(1, slope, 0).normalized(), forward = Vector3d::UnitZ(), out = forward.cross(along);
  const double c = std::cos(bow.pitch), s = std::sin(bow.pitch);
  return {Vector3d(x, bow.at[1] - drop, bow.at[0]), c * out - s * forward, c * forward + s * out};
}

/// u of a bow's landmark.
double share(const Bow& bow, int i) { return 2.0 * i / bow.divisions - 1; }

Vector3d in_pose(const Pose& pose, const Vector3d& p) {
  const Vector2d q = moved(pose, {p.z(), p.y()});
  return {p.x(), q.y(), q.x()};
}

/// (z, y) at a distance x from the car's middle plane.
Vector3d in_car(double x, const Vector2d& p) { return {x, p.y(), p.x()}; }

}  // namespace

RigidPose in_space(const Pose& pose) {
  // Forward (z) to up (y) is a turn about -x.
  return {{std::cos(pose.angle / 2), -std::sin(pose.angle / 2), 0, 0}, {0, pose.shift.y(), pose.shift.x()}};
}

double angle_at(const std::vector<double>& times, const std::vector<double>& angles, Profile profile, double time) {
  TOILE_CHECK(!times.empty() && times.size() == angles.size(), "{} times, {} angles", times.size(), angles.size());
  const auto next = std::upper_bound(times.begin(), times.end(), time);
  if (next == times.begin()) return angles.front();
  if (next == times.end()) return angles.back();
  const auto i = static_cast<std::size_t>(next - times.begin());
  double u = (time - times[i - 1]) / (times[i] - times[i - 1]);
  if (profile == Profile::smooth) u = u * u * (3 - 2 * u);
  return angles[i - 1] + u * (angles[i] - angles[i - 1]);
}

Result<mesh::SupportMesh> frame_surface(const Linkage& linkage) {
  Issues issues;
  Surface surface;
  mesh::SupportMesh result;
  result.region_names = linkage.bodies;
  const auto body_of = [&](const std::string& name) -> int {
    const auto it = std::find(result.region_names.begin(), result.region_names.end(), name);
    if (it != result.region_names.end()) return static_cast<int>(it - result.region_names.begin());
    result.region_names.push_back(name);  // ground
    return static_cast<int>(result.region_names.size()) - 1;
  };
  for (std::size_t b = 0; b < linkage.bars.size(); ++b) {
    const Bar& bar = linkage.bars[b];
    const int body = body_of(bar.body);
    std::vector<Vector2d> line;
    for (const auto& p : bar.points) line.emplace_back(p[0], p[1]);
    // Mitred corners: the offset square to a piece keeps its height on both sides of a corner.
    std::vector<Vector2d> across;
    bool sound = true;
    for (std::size_t i = 0; i < line.size() && sound; ++i) {
      const Vector2d before = (i > 0 ? line[i] - line[i - 1] : line[1] - line[0]), after = (i + 1 < line.size() ? line[i + 1] - line[i] : line[i] - line[i - 1]);
      sound = before.norm() > 1e-9 && after.norm() > 1e-9;
      if (!sound) break;
      const Vector2d n0(-before.y() / before.norm(), before.x() / before.norm()), n1(-after.y() / after.norm(), after.x() / after.norm());
      const double share = 1 + n0.dot(n1);
      sound = share > 0.1;
      if (sound) across.push_back((n0 + n1) / share);
    }
    if (!sound) {
      issues.push_back(Issue{"bad_bar", {.item = fmt::format("bars[{}]", b)}, "its line turns back on itself, or two of its points coincide", "move the points"});
      continue;
    }
    for (const double side : {-1.0, 1.0}) {
      std::vector<std::vector<Vector3d>> rings;
      for (std::size_t i = 0; i < line.size(); ++i) {
        const double x = side * bar.half_width, t = bar.thickness / 2, h = bar.height / 2;
        const Vector2d top = line[i] + h * across[i], low = line[i] - h * across[i];
        rings.push_back({in_car(x + t, low), in_car(x + t, top), in_car(x - t, top), in_car(x - t, low)});
      }
      surface.add_tube(rings, body);
    }
  }
  for (const Bow& bow : linkage.bows) {
    const int body = body_of(bow.body);
    std::vector<std::vector<Vector3d>> rings;
    for (int i = 0; i <= bow.divisions; ++i) {
      const auto [centre, thick, wide] = section(bow, share(bow, i));
      std::vector<Vector3d> ring;
      for (int k = 0; k < bow.sides; ++k) {
        const double phi = 2 * M_PI * k / bow.sides;
        ring.push_back(centre + 0.5 * bow.height * std::cos(phi) * thick + 0.5 * bow.width * std::sin(phi) * wide);
      }
      result.landmarks[fmt::format("{}_{}", bow.name, i)] = {ring[0].x(), ring[0].y(), ring[0].z()};
      rings.push_back(std::move(ring));
    }
    surface.add_tube(rings, body);
  }
  if (!issues.empty()) return issues;
  if (surface.faces.empty()) return Issue{"no_surface", {.item = "bars"}, "the linkage has neither bars nor bows", "give it some"};
  result.x.resize(static_cast<Eigen::Index>(surface.points.size()), 3);
  for (std::size_t i = 0; i < surface.points.size(); ++i) result.x.row(static_cast<Eigen::Index>(i)) = surface.points[i].transpose();
  result.faces.resize(static_cast<Eigen::Index>(surface.faces.size()), 3);
  for (std::size_t f = 0; f < surface.faces.size(); ++f) result.faces.row(static_cast<Eigen::Index>(f)) << surface.faces[f][0], surface.faces[f][1], surface.faces[f][2];
  result.face_region = Eigen::Map<const mesh::Ids>(surface.region.data(), static_cast<Eigen::Index>(surface.region.size()));
  return result;
}

Result<mesh::SupportMesh> skin_surface(const Linkage& linkage, const std::vector<Pose>& poses, const SkinOptions& options) {
  if (linkage.bows.size() < 2) return Issue{"no_skin", {.item = "bows"}, fmt::format("{} bows carry no skin", linkage.bows.size()), "give two bows at least, in the order in which the cloth runs over them"};
  const auto outer = [&](const Bow& bow, double u) -> Vector3d {
    const Section s = section(bow, u);
    const Vector3d p = s.centre + (0.5 * bow.height + options.offset) * s.thick;
    const auto body = static_cast<std::size_t>(std::find(linkage.bodies.begin(), linkage.bodies.end(), bow.body) - linkage.bodies.begin());
    return poses.empty() || body == linkage.bodies.size() ? p : in_pose(poses[body], p);
  };
  double widest = 0;
  for (const Bow& bow : linkage.bows) widest = std::max(widest, bow.half_width);
  const int columns = 2 * std::max(1, static_cast<int>(std::ceil((widest + options.overhang) / options.cell)));
  // One row of points a bow, and rows between.
  std::vector<std::vector<Vector3d>> bows, rows;
  for (const Bow& bow : linkage.bows) {
    std::vector<Vector3d> row;
    for (int i = 0; i <= columns; ++i) row.push_back(outer(bow, (2.0 * i / columns - 1) * (1 + options.overhang / bow.half_width)));
    bows.push_back(std::move(row));
  }
  const auto beyond = [&](const std::vector<Vector3d>& last, const std::vector<Vector3d>& before) {
    std::vector<Vector3d> row;
    for (std::size_t i = 0; i < last.size(); ++i) row.push_back(last[i] + options.overhang * (last[i] - before[i]).normalized());
    return row;
  };
  rows.push_back(beyond(bows[0], bows[1]));
  for (std::size_t b = 0; b + 1 < bows.size(); ++b) {
    double length = 0;
    for (std::size_t i = 0; i < bows[b].size(); ++i) length = std::max(length, (bows[b + 1][i] - bows[b][i]).norm());
    const int steps = std::max(1, static_cast<int>(std::ceil(length / options.cell)));
    for (int k = 0; k < steps; ++k) {
      std::vector<Vector3d> row;
      for (std::size_t i = 0; i < bows[b].size(); ++i) row.push_back(bows[b][i] + static_cast<double>(k) / steps * (bows[b + 1][i] - bows[b][i]));
      rows.push_back(std::move(row));
    }
  }
  rows.push_back(bows.back());
  rows.push_back(beyond(bows.back(), bows[bows.size() - 2]));

  mesh::SupportMesh result;
  result.region_names = {"outside", "inside"};
  const int across = columns + 1, count = static_cast<int>(rows.size()), layer = across * count;
  result.x.resize(2 * layer, 3);
  for (int r = 0; r < count; ++r) {
    for (int i = 0; i < across; ++i) {
      const Vector3d& p = rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(i)];
      result.x.row(r * across + i) = p.transpose();
      result.x.row(layer + r * across + i) = (p - options.thickness * Vector3d::UnitY()).transpose();
    }
  }
  std::vector<std::array<int, 3>> faces;
  std::vector<int> regions;
  const auto quad = [&](int a, int b, int c, int d, int region, bool turned) {
    if (turned) {
      faces.insert(faces.end(), {{a, b, d}, {b, c, d}});
    } else {
      faces.insert(faces.end(), {{a, b, c}, {a, c, d}});
    }
    regions.insert(regions.end(), {region, region});
  };
  // Rows run rearwards, columns from right to left: this order looks up. Diagonals are mirrored left and right.
  for (int r = 0; r + 1 < count; ++r) {
    for (int i = 0; i + 1 < across; ++i) {
      const int a = r * across + i, b = a + 1, c = a + across + 1, d = a + across;
      const bool left = i >= columns / 2;
      quad(a, d, c, b, 0, left);
      quad(layer + a, layer + b, layer + c, layer + d, 1, !left);
    }
  }
  for (int i = 0; i + 1 < across; ++i) {
    const int a = i, b = i + 1, c = (count - 1) * across + i, d = c + 1;
    const bool left = i >= columns / 2;
    quad(a, b, layer + b, layer + a, 1, left);
    quad(d, c, layer + c, layer + d, 1, !left);
  }
  for (int r = 0; r + 1 < count; ++r) {
    const int a = r * across, b = a + across, c = a + columns, d = b + columns;
    quad(b, a, layer + a, layer + b, 1, true);
    quad(c, d, layer + d, layer + c, 1, false);
  }
  if (mesh::volume(result.x, Eigen::Map<const mesh::Triangles>(faces.front().data(), static_cast<Eigen::Index>(faces.size()), 3)) < 0) {
    for (auto& face : faces) std::swap(face[1], face[2]);  // bows listed from the rear to the front
  }
  result.faces = Eigen::Map<const mesh::Triangles>(faces.front().data(), static_cast<Eigen::Index>(faces.size()), 3);
  result.face_region = Eigen::Map<const mesh::Ids>(regions.data(), static_cast<Eigen::Index>(regions.size()));
  for (const Bow& bow : linkage.bows) {
    for (int i = 0; i <= bow.divisions; ++i) {
      const Vector3d p = outer(bow, share(bow, i));
      result.landmarks[fmt::format("{}_{}", bow.name, i)] = {p.x(), p.y(), p.z()};
    }
  }
  return result;
}

mesh::SupportMesh moved(const mesh::SupportMesh& frame, const Linkage& linkage, const Configuration& configuration) {
  mesh::SupportMesh result = frame;
  const auto pose_of = [&](int region) -> Pose {
    const auto it = std::find(linkage.bodies.begin(), linkage.bodies.end(), frame.region_names[static_cast<std::size_t>(region)]);
    return it == linkage.bodies.end() ? Pose{} : configuration.poses[static_cast<std::size_t>(it - linkage.bodies.begin())];
  };
  for (Eigen::Index f = 0; f < frame.faces.rows(); ++f) {
    const Pose pose = pose_of(frame.face_region[f]);
    for (const int v : frame.faces.row(f)) result.x.row(v) = in_pose(pose, frame.x.row(v)).transpose();
  }
  for (const Bow& bow : linkage.bows) {
    const int region = static_cast<int>(std::find(frame.region_names.begin(), frame.region_names.end(), bow.body) - frame.region_names.begin());
    for (int i = 0; i <= bow.divisions; ++i) {
      auto& at = result.landmarks.at(fmt::format("{}_{}", bow.name, i));
      const Vector3d p = in_pose(pose_of(region), {at[0], at[1], at[2]});
      at = {p.x(), p.y(), p.z()};
    }
  }
  return result;
}

}  // namespace toile::mechanism
