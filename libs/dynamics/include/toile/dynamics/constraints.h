// What holds, drives and loads a garment from outside: named edges, points and regions with paths and loads over time.
// docs/simulation.md, "Constraints and loads".
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace toile::dynamics {

/// Part of a garment: named edges, points or whole panels, or a region of them.
struct Selection {
  std::vector<std::string> on;
  double from = 0, to = 1;
  std::vector<std::array<double, 2>> region;
};

enum class Hold {
  clamp,  ///< positions and tangent planes
  pin,    ///< positions
  slide,  ///< positions across a plane or a line
  drive,  ///< as pin; must have a path
};

struct ConstraintSpec {
  std::string name;
  std::vector<std::string> on;
  double from = 0, to = 1;
  std::vector<std::array<double, 2>> region;
  Hold kind = Hold::pin;
  std::string body;
  std::optional<std::array<double, 3>> along, normal;
  std::vector<double> times;
  std::vector<std::array<double, 3>> move;
  std::vector<double> turn;
  std::array<double, 3> axis{0, 0, 1};
  std::optional<std::array<double, 3>> centre;

  static void describe(auto& f) {
    using Spec = ConstraintSpec;
    f(&Spec::name, {.key = "name", .doc = "name in the record and the summary; not given: the first place that it holds"});
    f(&Spec::on, {.key = "on", .doc = "what it holds: panel.edge, panel.point or, with or without a region, panel", .required = true});
    f(&Spec::from, {.key = "from", .doc = "part of each edge, by arc length: begin", .unit = "1", .min = 0, .max = 1});
    f(&Spec::to, {.key = "to", .doc = "and end", .unit = "1", .min = 0, .max = 1});
    f(&Spec::region, {.key = "region", .doc = "outline in panel coordinates: only what lies inside or on it", .unit = "m"});
    f(&Spec::kind, {.key = "kind", .doc = "clamp: positions and tangent planes; pin: positions; slide: positions across `normal`, or but for `along`; drive: positions, along a path or with a `body`"});
    f(&Spec::body, {.key = "body", .doc = "the moving body that it is held to; not given: space, or the path"});
    f(&Spec::along, {.key = "along", .doc = "slide: the only direction that is free"});
    f(&Spec::normal, {.key = "normal", .doc = "slide: the only direction that is held"});
    f(&Spec::times, {.key = "times", .doc = "path: times of the rows of `move` and `turn`, increasing; straight in between, held before and after", .unit = "s"});
    f(&Spec::move, {.key = "move", .doc = "path: shift from the start at each of these times", .unit = "m"});
    f(&Spec::turn, {.key = "turn", .doc = "path: angle about `axis` through `centre`, before the shift", .unit = "rad"});
    f(&Spec::axis, {.key = "axis", .doc = "of the turn"});
    f(&Spec::centre, {.key = "centre", .doc = "of the turn; not given: the mean of the held particles at the start", .unit = "m"});
    f.check([](const Spec& s, Issues& issues) {
      const auto bad = [&](const char* item, const char* what, const char* remedy) { issues.push_back({"bad_constraint", {.item = item}, what, remedy}); };
      if (s.kind == Hold::slide && s.along.has_value() == s.normal.has_value()) bad("kind", "a slide has one direction", "give either `along` or `normal`");
      if (s.kind != Hold::slide && (s.along || s.normal)) bad("kind", "only a slide has `along` or `normal`", "write `kind: slide`");
      if (s.kind == Hold::drive && s.times.empty() && s.body.empty()) bad("times", "a drive has a path", "give `times` with `move` or `turn`, or a `body`");
      if (!s.body.empty() && !s.times.empty()) bad("body", "what is held to a body follows no path of its own", "leave out `times`, or `body`");
      if (!s.body.empty() && s.kind == Hold::slide) bad("body", "a slide is in space, not on a body", "use kind drive, pin or clamp");
      if (!s.times.empty() && s.move.empty() && s.turn.empty()) bad("times", "a path says nothing", "give `move` or `turn`");
      if (!s.move.empty() && s.move.size() != s.times.size()) bad("move", "a path has a row for each time", "give as many rows as `times`");
      if (!s.turn.empty() && s.turn.size() != s.times.size()) bad("turn", "a path has an angle for each time", "give as many angles as `times`");
      for (std::size_t i = 1; i < s.times.size(); ++i) {
        if (!(s.times[i] > s.times[i - 1])) {
          bad("times", "times must increase", "sort the rows of the path");
          break;
        }
      }
      if (s.from >= s.to) bad("from", "the part of the edge is empty", "give `from` below `to`");
      if (!s.region.empty() && s.region.size() < 3) bad("region", "an outline has three corners at least", "add corners");
      for (const auto& d : {s.along, s.normal, std::optional(s.axis)}) {
        if (d && !((*d)[0] * (*d)[0] + (*d)[1] * (*d)[1] + (*d)[2] * (*d)[2] > 0)) bad("kind", "a direction has no length", "give another vector");
      }
    });
  }
};

struct LoadSpec {
  std::string name;
  std::vector<std::string> on;
  double from = 0, to = 1;
  std::vector<std::array<double, 2>> region;
  std::array<double, 3> force{0, 0, 0};
  std::vector<double> times, factor;

  static void describe(auto& f) {
    using Spec = LoadSpec;
    f(&Spec::name, {.key = "name", .doc = "name"});
    f(&Spec::on, {.key = "on", .doc = "where it acts: panel.edge, panel.point or panel; spread evenly over the length of edges, the area of panels", .required = true});
    f(&Spec::from, {.key = "from", .doc = "part of each edge, by arc length: begin", .unit = "1", .min = 0, .max = 1});
    f(&Spec::to, {.key = "to", .doc = "and end", .unit = "1", .min = 0, .max = 1});
    f(&Spec::region, {.key = "region", .doc = "outline in panel coordinates: only what lies inside or on it", .unit = "m"});
    f(&Spec::force, {.key = "force", .doc = "whole force", .unit = "N", .required = true});
    f(&Spec::times, {.key = "times", .doc = "times of the rows of `factor`, increasing", .unit = "s"});
    f(&Spec::factor, {.key = "factor", .doc = "part of the force at each of these times, straight in between"});
    f.check([](const Spec& s, Issues& issues) {
      if (s.times.size() != s.factor.size()) issues.push_back({"bad_load", {.item = "factor"}, "there must be a factor for each time", "give as many as `times`"});
      for (std::size_t i = 1; i < s.times.size(); ++i) {
        if (!(s.times[i] > s.times[i - 1])) {
          issues.push_back({"bad_load", {.item = "times"}, "times must increase", "sort the rows"});
          break;
        }
      }
      if (s.from >= s.to) issues.push_back({"bad_load", {.item = "from"}, "the part of the edge is empty", "give `from` below `to`"});
      if (!s.region.empty() && s.region.size() < 3) issues.push_back({"bad_load", {.item = "region"}, "an outline has three corners at least", "add corners"});
    });
  }
};

/// Two points that stay at a distance from each other.
struct DistanceSpec {
  std::string name;
  std::vector<std::string> between;
  std::optional<double> distance;

  static void describe(auto& f) {
    using Spec = DistanceSpec;
    f(&Spec::name, {.key = "name", .doc = "name in the summary; not given: the first point"});
    f(&Spec::between, {.key = "between", .doc = "two points, panel.point", .required = true});
    f(&Spec::distance, {.key = "distance", .doc = "that they are held at; not given: that of the start", .unit = "m", .min = 1e-6, .max = 1e3});
    f.check([](const Spec& s, Issues& issues) {
      if (s.between.size() != 2) issues.push_back({"bad_constraint", {.item = "between"}, "a distance is between two points", "name two"});
    });
  }
};

/// Vertices with the part that each has in the whole: by length along edges, by area in panels, evenly for points.
struct Selected {
  std::vector<int> vertices;    ///< each once, in increasing order
  std::vector<double> share;    ///< sums to 1
};

/// error  "bad_reference", "unknown_panel", "unknown_edge", "empty_selection"
Result<Selected> select(const mesh::GarmentMesh& garment, const Selection& selection, const std::string& item);

/// Where a path leads from a starting point.
struct Motion {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d move = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d operator()(const Eigen::Vector3d& start) const { return turn * (start - centre) + centre + move; }
};
Motion motion_at(const ConstraintSpec& spec, const Eigen::Vector3d& centre, double time);

/// Value of a table at a time, straight between its rows and level before and after; 1 where it has none.
double factor_at(const std::vector<double>& times, const std::vector<double>& values, double time);

}  // namespace toile::dynamics

template <>
struct toile::Choices<toile::dynamics::Hold> {
  static constexpr std::array names{std::pair{"clamp", toile::dynamics::Hold::clamp}, std::pair{"pin", toile::dynamics::Hold::pin},
                                    std::pair{"slide", toile::dynamics::Hold::slide}, std::pair{"drive", toile::dynamics::Hold::drive}};
};
