#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "geometry.h"

namespace toile::pattern {
namespace {

double cross(const Point2& a, const Point2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Reflection about the line through a along d.
Similarity reflection(const Point2& a, const Point2& d) {
  const Point2 e = d.normalized();
  Similarity map;
  map.linear << e.x() * e.x() - e.y() * e.y(), 2 * e.x() * e.y(), 2 * e.x() * e.y(), e.y() * e.y() - e.x() * e.x();
  map.offset = a - map.linear * a;
  return map;
}

PanelEdge reversed(const PanelEdge& edge) {
  return {edge.name, edge.to, edge.from, edge.curve.reversed(), edge.allowance};
}

void reverse_loop(std::vector<PanelEdge>& edges) {
  std::reverse(edges.begin(), edges.end());
  for (PanelEdge& edge : edges) edge = reversed(edge);
  // The loop starts with the same edge as before.
  std::rotate(edges.begin(), edges.end() - 1, edges.end());
}

double loop_area(const std::vector<PanelEdge>& edges) {
  double area = 0;
  for (const PanelEdge& edge : edges) area += edge.curve.sector_area();
  return area;
}

/// otherwise  allowance of edges that have none of their own [pattern units]
std::vector<PanelEdge> panel_edges(const Piece& piece, const std::vector<Edge>& edges, double otherwise, const Similarity& map) {
  const double scale = std::sqrt(std::abs(map.linear.determinant()));
  std::vector<PanelEdge> result;
  for (const Edge& edge : edges) {
    std::vector<Segment> segments;
    for (const Segment& segment : edge.segments) segments.push_back(map(segment));
    // Ends within the weld tolerance become equal.
    segments.front().from = map(piece.points.at(edge.from));
    segments.back().to = map(piece.points.at(edge.to));
    for (std::size_t i = 1; i < segments.size(); ++i) segments[i].from = segments[i - 1].to;
    result.push_back({edge.name, edge.from, edge.to, Curve(std::move(segments)), edge.allowance.value_or(otherwise) * scale});
  }
  for (std::size_t i = 0; i < result.size(); ++i) {
    const Point2 end = result[(i + result.size() - 1) % result.size()].curve.to();
    if (result[i].curve.from() == end) continue;
    std::vector<Segment> segments = result[i].curve.segments();
    segments.front().from = end;
    result[i].curve = Curve(std::move(segments));
  }
  return result;
}

/// Notches by edge and arc length, before anything is reversed.
std::vector<PanelNotch> panel_notches(const Piece& piece, const CutPanel& panel, const Similarity& map) {
  const double scale = std::sqrt(std::abs(map.linear.determinant()));
  std::vector<PanelNotch> result;
  for (const Notch& notch : piece.notches) {
    const Curve& curve = find_edge(panel, notch.edge)->curve;
    double s = 0;
    if (notch.point) s = curve.nearest(map(piece.points.at(*notch.point))).s;
    if (notch.distance) s = *notch.distance * scale + (*notch.distance < 0 ? curve.length() : 0);
    if (notch.fraction) s = *notch.fraction * curve.length();
    result.push_back({notch.name, notch.edge, std::clamp(s, 0.0, curve.length()), Point2::Zero()});
  }
  return result;
}

void reverse_notches(CutPanel& panel, const std::vector<std::string>& edges) {
  for (PanelNotch& notch : panel.notches) {
    if (std::find(edges.begin(), edges.end(), notch.edge) == edges.end()) continue;
    notch.s = find_edge(panel, notch.edge)->curve.length() - notch.s;
  }
}

std::vector<std::string> names(const std::vector<PanelEdge>& edges) {
  std::vector<std::string> result;
  for (const PanelEdge& edge : edges) result.push_back(edge.name);
  return result;
}

/// Turns loops round where needed: outline counter-clockwise, holes clockwise.
void orient(CutPanel& panel) {
  if (loop_area(panel.outline) < 0) {
    reverse_loop(panel.outline);
    reverse_notches(panel, names(panel.outline));
  }
  for (PanelHole& hole : panel.holes) {
    if (loop_area(hole.edges) > 0) {
      reverse_loop(hole.edges);
      reverse_notches(panel, names(hole.edges));
    }
  }
}

CutPanel mapped(const CutPanel& panel, const Similarity& map) {
  CutPanel result = panel;
  const auto apply = [&](std::vector<PanelEdge>& edges) {
    for (PanelEdge& edge : edges) edge.curve = edge.curve.mapped(map);
  };
  apply(result.outline);
  for (PanelHole& hole : result.holes) apply(hole.edges);
  for (PanelLine& line : result.lines) line.curve = line.curve.mapped(map);
  for (PanelPoint& point : result.points) point.at = map(point.at);
  for (PanelMark& mark : result.marks) mark.at = map(mark.at);
  if (result.fold) result.fold = {map(result.fold->first), map(result.fold->second)};
  return result;
}

/// Both halves of a piece whose outline (counter-clockwise) has the fold edge.
CutPanel unfolded(CutPanel panel, const std::string& fold_name) {
  const auto fold_at = std::find_if(panel.outline.begin(), panel.outline.end(),
                                    [&](const PanelEdge& edge) { return edge.name == fold_name; });
  std::rotate(panel.outline.begin(), fold_at, panel.outline.end());
  const PanelEdge fold = panel.outline.front();
  panel.outline.erase(panel.outline.begin());
  const Point2 a = fold.curve.from(), b = fold.curve.to(), d = (b - a).normalized();
  const auto on_fold = [&](const Point2& p) { return std::abs(cross(d, p - a)) <= weld_tolerance; };

  CutPanel other = mapped(panel, reflection(a, d));
  const auto rename_end = [&](std::string& name) {
    const auto at =
        std::find_if(panel.points.begin(), panel.points.end(), [&](const PanelPoint& p) { return p.name == name; });
    if (!on_fold(at->at)) name += "_m";
  };
  for (PanelEdge& edge : other.outline) edge.name += "_m", rename_end(edge.from), rename_end(edge.to);
  for (PanelHole& hole : other.holes) {
    hole.name += "_m";
    for (PanelEdge& edge : hole.edges) edge.name += "_m", rename_end(edge.from), rename_end(edge.to);
    reverse_loop(hole.edges);
  }
  // The half runs from b round to a; its mirror image, turned round, from a to b. Ends on the fold are made equal.
  std::reverse(other.outline.begin(), other.outline.end());
  for (PanelEdge& edge : other.outline) edge = reversed(edge);
  const auto move_end = [](PanelEdge& edge, const Point2& p, bool first) {
    std::vector<Segment> segments = edge.curve.segments();
    (first ? segments.front().from : segments.back().to) = p;
    edge.curve = Curve(std::move(segments));
  };
  move_end(other.outline.front(), panel.outline.back().curve.to(), true);
  move_end(other.outline.back(), panel.outline.front().curve.from(), false);

  // A notch on the fold edge marks a point of the fold, not of the border.
  std::erase_if(panel.notches, [&](const PanelNotch& notch) { return notch.edge == fold_name; });
  other.notches = panel.notches;
  for (PanelNotch& notch : other.notches) {
    notch.s = find_edge(panel, notch.edge)->curve.length() - notch.s;
    notch.name += "_m";
    notch.edge += "_m";
  }
  panel.outline.insert(panel.outline.end(), other.outline.begin(), other.outline.end());
  panel.holes.insert(panel.holes.end(), other.holes.begin(), other.holes.end());
  panel.notches.insert(panel.notches.end(), other.notches.begin(), other.notches.end());
  for (PanelLine& line : other.lines) {
    const bool inside_fold =
        std::all_of(line.curve.segments().begin(), line.curve.segments().end(), [&](const Segment& s) {
          return on_fold(s.from) && on_fold(s.to) && on_fold(position(s, 0.3)) && on_fold(position(s, 0.7));
        });
    if (inside_fold) continue;
    line.name += "_m";
    line.reflected = true;
    panel.lines.push_back(line);
  }
  for (PanelPoint& point : other.points) {
    if (on_fold(point.at)) continue;
    point.name += "_m";
    panel.points.push_back(point);
  }
  for (PanelMark& mark : other.marks) {
    if (on_fold(mark.at)) continue;
    mark.name += "_m";
    panel.marks.push_back(mark);
  }
  panel.fold = {a, b};
  return panel;
}

/// Area of the allowances outside a loop: strips beside its sides and what corners add or count twice.
double loop_allowance(const std::vector<PanelEdge>& edges) {
  std::vector<Curve> curves;
  for (const PanelEdge& edge : edges) curves.push_back(edge.curve);
  const Polyline loop = flatten(curves, 1e-6);
  const std::size_t sides = loop.points.size() - 1;
  constexpr double sharpest = 2 * std::numbers::pi / 3;
  double area = 0;
  for (std::size_t i = 0; i < sides; ++i) {
    const std::size_t j = (i + 1) % sides;
    const Point2 in = loop.points[i + 1] - loop.points[i], out = loop.points[j + 1] - loop.points[j];
    const double a = edges[static_cast<std::size_t>(loop.curve[i])].allowance, b = edges[static_cast<std::size_t>(loop.curve[j])].allowance;
    area += a * in.norm();
    const double turn = std::atan2(cross(in, out), in.dot(out)), angle = std::min(std::abs(turn), sharpest);
    if (!(angle > 0)) continue;
    // From the squared-off end of either strip to where the offset lines meet.
    const double after = a == b ? a * std::tan(angle / 2) : (b - a * std::cos(angle)) / std::sin(angle);
    const double before = a == b ? after : (a - b * std::cos(angle)) / std::sin(angle);
    if (after < 0 || before < 0) continue;
    area += std::copysign(0.5 * (a * after + b * before), turn);
  }
  return area;
}

/// What follows from the finished geometry: area, positions of notches, where points lie.
void complete(CutPanel& panel) {
  panel.area = loop_area(panel.outline);
  panel.perimeter = 0;
  for (const PanelEdge& edge : panel.outline) panel.perimeter += edge.curve.length();
  panel.allowance_area = loop_allowance(panel.outline);
  for (const PanelHole& hole : panel.holes) {
    panel.area += loop_area(hole.edges);
    panel.allowance_area += loop_allowance(hole.edges);
  }
  for (PanelNotch& notch : panel.notches) notch.at = find_edge(panel, notch.edge)->curve.point_at(notch.s);
  std::vector<const PanelEdge*> edges;
  for (const PanelEdge& edge : panel.outline) edges.push_back(&edge);
  for (const PanelHole& hole : panel.holes) {
    for (const PanelEdge& edge : hole.edges) edges.push_back(&edge);
  }
  const auto loop_line = [](const std::vector<PanelEdge>& loop) {
    std::vector<Curve> curves;
    for (const PanelEdge& edge : loop) curves.push_back(edge.curve);
    return flatten(curves, 1e-6);
  };
  const Polyline border = loop_line(panel.outline);
  std::vector<Polyline> holes;
  for (const PanelHole& hole : panel.holes) holes.push_back(loop_line(hole.edges));
  for (PanelPoint& point : panel.points) {
    point.where = PanelPoint::Where::inside;
    point.edge.clear();
    point.s = 0;
    for (const PanelEdge* edge : edges) {
      if (edge->from != point.name) continue;
      point.where = PanelPoint::Where::border;
      point.edge = edge->name;
      break;
    }
    if (point.where == PanelPoint::Where::border) continue;
    double best = weld_tolerance;
    for (const PanelEdge* edge : edges) {
      const Curve::Nearest nearest = edge->curve.nearest(point.at);
      // At a corner (a second name for it) the edge that starts there is taken.
      if (nearest.distance > best || nearest.s >= edge->curve.length()) continue;
      best = nearest.distance;
      point.where = PanelPoint::Where::border;
      point.edge = edge->name;
      point.s = nearest.s;
    }
    if (point.where == PanelPoint::Where::border) continue;
    const bool in_hole =
        std::any_of(holes.begin(), holes.end(), [&](const Polyline& hole) { return winds_around(hole, point.at); });
    if (!winds_around(border, point.at) || in_hole) point.where = PanelPoint::Where::outside;
  }
  std::sort(panel.points.begin(), panel.points.end(),
            [](const PanelPoint& a, const PanelPoint& b) { return a.name < b.name; });
}

/// From pattern coordinates to panel coordinates: metres, v along the grain.
Similarity panel_from_pattern(const Pattern& pattern, const Piece& piece) {
  const Similarity metres = metres_from_pattern(pattern);
  Point2 warp(0, 1);
  if (piece.grain) {
    warp = metres.linear * (piece.grain->to - piece.grain->from);
  } else if (piece.fold) {
    const auto fold = std::find_if(piece.outline.begin(), piece.outline.end(),
                                   [&](const Edge& edge) { return edge.name == *piece.fold; });
    warp = metres.linear * (fold->segments.back().to - fold->segments.front().from);
    if (warp.y() < 0 || (warp.y() == 0 && warp.x() < 0)) warp = -warp;
  }
  warp.normalize();
  Similarity map = metres;
  Eigen::Matrix2d turn;
  turn << warp.y(), -warp.x(), warp.x(), warp.y();
  map.linear = turn * metres.linear;
  return map;
}

}  // namespace

std::string panel_name(const Piece& piece, int copy) {
  const bool pairs = !piece.identical && !piece.fold;
  const int number = pairs ? copy / 2 : copy;
  return fmt::format("{}{}{}", piece.name, number > 0 ? fmt::format("_{}", number + 1) : "",
                     pairs && copy % 2 == 1 ? "_m" : "");
}

Result<std::vector<CutPanel>> cut_panels(const Pattern& pattern) {
  Issues issues = check(pattern);
  if (!issues.empty()) return issues;
  std::vector<CutPanel> panels;
  for (const Piece& piece : pattern.pieces) {
    const Similarity map = panel_from_pattern(pattern, piece);
    CutPanel panel;
    panel.piece = piece.name;
    panel.material = piece.material;
    panel.outline = panel_edges(piece, piece.outline, piece.allowance.value_or(0), map);
    for (const Hole& hole : piece.holes) panel.holes.push_back({hole.name, panel_edges(piece, hole.edges, 0, map)});
    for (const InternalLine& line : piece.lines) {
      std::vector<Segment> segments;
      for (const Segment& segment : line.segments) segments.push_back(map(segment));
      panel.lines.push_back({line.name, line.kind, Curve(std::move(segments)), false});
    }
    for (const auto& [name, p] : piece.points) panel.points.push_back({.name = name, .at = map(p)});
    for (const Mark& mark : piece.marks) panel.marks.push_back({mark.name, mark.kind, map(mark.at)});
    panel.notches = panel_notches(piece, panel, map);
    orient(panel);
    if (piece.fold) panel = unfolded(std::move(panel), *piece.fold);
    for (int copy = 0; copy < piece.copies; ++copy) {
      CutPanel one = panel;
      one.name = panel_name(piece, copy);
      one.mirrored = !piece.identical && !piece.fold && copy % 2 == 1;
      if (one.mirrored) {
        Similarity mirror;
        mirror.linear << -1, 0, 0, 1;
        one = mapped(one, mirror);
        for (PanelLine& line : one.lines) line.reflected = !line.reflected;
        orient(one);
      }
      complete(one);
      panels.push_back(std::move(one));
    }
  }
  return panels;
}

namespace {

/// Arc lengths at which a closed curve turns by more than 60 degrees, ascending in [0, length).
std::vector<double> sharp_corners(const Curve& curve) {
  std::vector<double> corners;
  const std::vector<double>& starts = curve.segment_starts();
  const double length = curve.length(), step = 1e-6 * length;
  for (std::size_t k = 0; k + 1 < starts.size(); ++k) {
    const double s = starts[k];
    const Point2 here = curve.point_at(s), in = here - curve.point_at(k == 0 ? length - step : s - step), out = curve.point_at(s + step) - here;
    if (std::abs(std::atan2(cross(in, out), in.dot(out))) > std::numbers::pi / 3) corners.push_back(s);
  }
  return corners;
}

/// The edges of a hole that one closed line bounds, in the line's direction.
std::vector<PanelEdge> edges_of(const PanelLine& line) {
  std::vector<Segment> segments = line.curve.segments();
  segments.back().to = segments.front().from;
  const Curve curve(std::move(segments));
  const std::vector<double> corners = sharp_corners(curve);
  if (corners.empty()) return {{line.name, "", "", curve, 0}};
  std::vector<PanelEdge> edges;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const bool last = k + 1 == corners.size();
    std::vector<Segment> part = curve.part(corners[k], last ? curve.length() : corners[k + 1]).segments();
    if (last && corners.front() > 0) {
      const std::vector<Segment> rest = curve.part(0, corners.front()).segments();
      part.insert(part.end(), rest.begin(), rest.end());
    }
    part.front().from = edges.empty() ? part.front().from : edges.back().curve.to();
    if (last) part.back().to = edges.empty() ? part.front().from : edges.front().curve.from();
    edges.push_back({corners.size() == 1 ? line.name : fmt::format("{}_{}", line.name, k + 1), "", "", Curve(std::move(part)), 0});
  }
  return edges;
}

/// Closed chains of open lines: for each the lines in order, the first in its own direction.
std::vector<std::vector<std::pair<std::size_t, bool>>> chains(const std::vector<PanelLine>& lines, const std::vector<std::size_t>& open) {
  // Ends that meet are one node; lines with a loose end are taken away until none is left.
  std::vector<Point2> nodes;
  std::vector<std::array<std::size_t, 2>> ends;
  for (std::size_t l : open) {
    std::array<std::size_t, 2> own{};
    for (std::size_t e = 0; e < 2; ++e) {
      const Point2 p = e == 0 ? lines[l].curve.from() : lines[l].curve.to();
      own[e] = static_cast<std::size_t>(std::find_if(nodes.begin(), nodes.end(), [&](const Point2& n) { return (n - p).norm() <= on_edge_tolerance; }) - nodes.begin());
      if (own[e] == nodes.size()) nodes.push_back(p);
    }
    ends.push_back(own);
  }
  std::vector<char> alive(open.size(), 1);
  const auto degree = [&](std::size_t node) {
    int count = 0;
    for (std::size_t k = 0; k < open.size(); ++k) count += alive[k] ? (ends[k][0] == node) + (ends[k][1] == node) : 0;
    return count;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t k = 0; k < open.size(); ++k) {
      if (!alive[k] || (degree(ends[k][0]) > 1 && degree(ends[k][1]) > 1)) continue;
      alive[k] = 0;
      changed = true;
    }
  }
  std::vector<std::vector<std::pair<std::size_t, bool>>> result;
  for (std::size_t first = 0; first < open.size(); ++first) {
    if (!alive[first]) continue;
    std::vector<std::pair<std::size_t, bool>> chain{{open[first], false}};
    std::vector<std::size_t> members{first};
    std::size_t at = ends[first][1];
    bool simple = degree(ends[first][0]) == 2;
    while (simple && at != ends[first][0]) {
      simple = degree(at) == 2;
      for (std::size_t k = 0; simple && k < open.size(); ++k) {
        if (!alive[k] || std::find(members.begin(), members.end(), k) != members.end() || (ends[k][0] != at && ends[k][1] != at)) continue;
        const bool backwards = ends[k][1] == at;
        chain.emplace_back(open[k], backwards);
        members.push_back(k);
        at = ends[k][backwards ? 0 : 1];
        break;
      }
    }
    for (std::size_t k : members) alive[k] = 0;
    if (simple) result.push_back(std::move(chain));
  }
  return result;
}

}  // namespace

Result<CutPanel> cut_out(const CutPanel& source, const std::vector<std::string>& names) {
  CutPanel panel = source;
  std::vector<PanelHole> fresh;
  std::vector<char> gone(source.lines.size(), 0);
  std::vector<std::size_t> open;
  for (std::size_t l = 0; l < source.lines.size(); ++l) {
    const PanelLine& line = source.lines[l];
    if (std::find(names.begin(), names.end(), line.name) == names.end()) continue;
    if (!line.closed()) {
      open.push_back(l);
      continue;
    }
    fresh.push_back({line.name, edges_of(line)});
    gone[l] = 1;
  }
  for (const auto& chain : chains(source.lines, open)) {
    PanelHole hole{source.lines[chain.front().first].name, {}};
    for (const auto& [l, backwards] : chain) {
      gone[l] = 1;
      PanelEdge edge{source.lines[l].name, "", "", source.lines[l].curve, 0};
      if (backwards) edge = reversed(edge);
      if (!hole.edges.empty()) {
        std::vector<Segment> segments = edge.curve.segments();
        segments.front().from = hole.edges.back().curve.to();
        edge.curve = Curve(std::move(segments));
      }
      hole.edges.push_back(std::move(edge));
    }
    std::vector<Segment> segments = hole.edges.back().curve.segments();
    segments.back().to = hole.edges.front().curve.from();
    hole.edges.back().curve = Curve(std::move(segments));
    fresh.push_back(std::move(hole));
  }
  Issues issues;
  panel.lines.clear();
  for (std::size_t l = 0; l < source.lines.size(); ++l) {
    if (!gone[l]) panel.lines.push_back(source.lines[l]);
  }
  for (PanelHole& hole : fresh) {
    if (loop_area(hole.edges) > 0) reverse_loop(hole.edges);
    for (const PanelEdge& edge : hole.edges) {
      const bool line = std::any_of(panel.lines.begin(), panel.lines.end(), [&](const PanelLine& other) { return other.name == edge.name; });
      if (line || find_edge(panel, edge.name)) {
        issues.push_back({"duplicate_name", {.item = panel.name + "." + hole.name}, fmt::format("cutting it out gives an edge '{}', but there is one", edge.name), "rename one of them"});
      }
    }
    std::vector<Curve> curves;
    for (const PanelEdge& edge : hole.edges) curves.push_back(edge.curve);
    const Polyline loop = flatten(curves, 1e-6);
    std::erase_if(panel.marks, [&](const PanelMark& mark) { return winds_around(loop, mark.at) && distance_to(loop, mark.at) > on_edge_tolerance; });
    panel.holes.push_back(std::move(hole));
  }
  if (!issues.empty()) return issues;
  if (!fresh.empty()) complete(panel);
  return panel;
}

}  // namespace toile::pattern
