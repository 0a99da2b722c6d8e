#include <algorithm>
#include <cmath>

#include "draft.h"

namespace toile::io {
namespace {

/// A point given relative to a chord: x along it, y to its left, both over its length.
Point2 on_chord(const Point2& from, const Point2& to, const Point2& relative) {
  const Point2 d = to - from;
  return from + relative.x() * d + relative.y() * Point2(-d.y(), d.x());
}

Point2 pair_of_numbers(const ordered_json& j, const std::string& where) {
  need(j.is_array() && j.size() == 2 && j[0].is_number() && j[1].is_number(), where, "two numbers");
  return {j[0].get<double>(), j[1].get<double>()};
}

Segment read_edge(const ordered_json& edge, const Point2& from, const Point2& to, double mm, const std::string& where) {
  if (!edge.contains("curvature")) return pattern::line_segment(from, to);
  const ordered_json& curvature = edge["curvature"];
  if (curvature.is_array())
    return pattern::quadratic_segment(from, on_chord(from, to, pair_of_numbers(curvature, where)), to);
  need(curvature.is_object() && curvature.contains("type") && curvature.contains("params") &&
           curvature["params"].is_array(),
       where, "a curvature with type and params");
  const ordered_json& params = curvature["params"];
  const std::string type = curvature["type"].get<std::string>();
  if (type == "quadratic") {
    need(params.size() == 1, where, "one control point");
    return pattern::quadratic_segment(from, on_chord(from, to, pair_of_numbers(params[0], where)), to);
  }
  if (type == "cubic") {
    need(params.size() == 2, where, "two control points");
    return pattern::cubic_segment(from, on_chord(from, to, pair_of_numbers(params[0], where)),
                                  on_chord(from, to, pair_of_numbers(params[1], where)), to);
  }
  need(type == "circle", where, "a curvature of type quadratic, cubic or circle");
  need(params.size() == 3 && params[0].is_number(), where, "radius, large arc and side");
  const auto flag = [&](const ordered_json& j) {
    need(j.is_boolean() || j.is_number_integer(), where, "a flag");
    return j.is_boolean() ? j.get<bool>() : j.get<int>() != 0;
  };
  const double radius = params[0].get<double>() * mm, half = (to - from).norm() / 2;
  need(radius >= half * (1 - 1e-6) && half > 0, where, "a radius that reaches both ends");
  const double quarter = std::asin(std::min(1.0, half / radius)) / 2;
  const double size = flag(params[1]) ? 1 / std::tan(quarter) : std::tan(quarter);
  // An arc on the right of its chord turns left.
  return pattern::arc_segment(from, to, flag(params[2]) ? size : -size);
}

std::string vertex(std::size_t i) {
  return "v" + std::to_string(i);
}

}  // namespace

Draft read_garmentcode(const ordered_json& root, Issues& notes) {
  Draft draft;
  draft.origin = "GarmentCode";
  draft.y_down = false;
  const ordered_json& pattern = root["pattern"];
  need(pattern.is_object() && pattern.contains("panels") && pattern["panels"].is_object(), "pattern",
       "an object with panels");
  double mm = 10;
  if (root.contains("properties") && root["properties"].is_object()) {
    const ordered_json& properties = root["properties"];
    const double units = properties.value("units_in_meter", 100.0);
    need(units > 0, "units_in_meter", "a positive number");
    mm = 1000 / units;
    need(properties.value("curvature_coords", "relative") == "relative", "curvature_coords", "'relative'");
  }
  std::map<std::string, std::vector<std::pair<std::string, std::string>>> edge_ends;
  for (const auto& [name, panel] : pattern["panels"].items()) {
    need(panel.is_object() && panel.contains("vertices") && panel["vertices"].is_array() && panel.contains("edges") &&
             panel["edges"].is_array() && panel["edges"].size() >= 2,
         name, "a panel with vertices and at least two edges");
    DraftPart part;
    part.name = name;
    for (std::size_t i = 0; i < panel["vertices"].size(); ++i) {
      part.points.emplace_back(vertex(i), mm * pair_of_numbers(panel["vertices"][i], name + " vertices"));
    }
    DraftPath seam;
    seam.strokes.emplace_back();
    double area = 0;
    for (std::size_t i = 0; i < panel["edges"].size(); ++i) {
      const ordered_json& edge = panel["edges"][i];
      const std::string where = fmt::format("{} edge {}", name, i);
      need(edge.is_object() && edge.contains("endpoints") && edge["endpoints"].is_array() &&
               edge["endpoints"].size() == 2 && edge["endpoints"][0].is_number_unsigned() &&
               edge["endpoints"][1].is_number_unsigned(),
           where, "an edge with two endpoints");
      const auto a = edge["endpoints"][0].get<std::size_t>(), b = edge["endpoints"][1].get<std::size_t>();
      need(a < part.points.size() && b < part.points.size(), where, "endpoints among the vertices");
      seam.strokes[0].push_back(read_edge(edge, part.points[a].second, part.points[b].second, mm, where));
      need(i == 0 || (seam.strokes[0][i - 1].to - seam.strokes[0][i].from).norm() < 1e-6, where,
           "an edge that starts where the one before ends");
      area += sector_area(seam.strokes[0].back());
      edge_ends[name].emplace_back(vertex(a), vertex(b));
      // Two edges that share both ends cannot be told apart by a run.
      if (panel["edges"].size() > 2) part.edges["e" + std::to_string(i)] = vertex(a) + ">" + vertex(b);
    }
    // The face of a panel is where its edges run counter-clockwise: a clockwise one is drawn from behind.
    if (area < 0) {
      pattern::Similarity flip;
      flip.linear << -1, 0, 0, 1;
      for (auto& [id, p] : part.points) p = flip(p);
      for (Segment& segment : seam.strokes[0]) segment = flip(segment);
    }
    part.paths.emplace_back("seam", std::move(seam));
    part.drawn.push_back("seam");
    draft.parts.push_back(std::move(part));
  }
  if (!pattern.contains("stitches")) return draft;
  need(pattern["stitches"].is_array(), "stitches", "a list");
  for (std::size_t i = 0; i < pattern["stitches"].size(); ++i) {
    const ordered_json& entry = pattern["stitches"][i];
    const std::string where = fmt::format("stitch {}", i + 1);
    need(entry.is_array() && entry.size() >= 2, where, "a pair of sides");
    Draft::Stitch stitch;
    for (std::size_t side = 0; side < 2; ++side) {
      const ordered_json& j = entry[side];
      need(j.is_object() && j.contains("panel") && j["panel"].is_string() && j.contains("edge") &&
               j["edge"].is_number_unsigned(),
           where, "panel and edge");
      stitch.part[side] = j["panel"].get<std::string>();
      const auto ends = edge_ends.find(stitch.part[side]);
      const auto edge = j["edge"].get<std::size_t>();
      need(ends != edge_ends.end() && edge < ends->second.size(), where, "a panel and an edge that exist");
      stitch.ends[side] = ends->second[edge];
      stitch.same_direction = stitch.same_direction || j.value("right_wrong", false);
    }
    if (entry.size() > 2) {
      if (entry[2] == "right_wrong") {
        stitch.same_direction = true;
      } else {
        notes.push_back(Issue{"unknown_stitch", {.item = where}, "its third entry is not known and left out", ""});
      }
    }
    draft.stitches.push_back(stitch);
  }
  return draft;
}

}  // namespace toile::io
