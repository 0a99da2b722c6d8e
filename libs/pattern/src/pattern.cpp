#include "toile/pattern/pattern.h"

#include <algorithm>
#include <cmath>

#include "toile/base/text.h"

namespace toile::pattern {
namespace {

std::vector<Edge>* loop_with_edge(Piece& piece, const std::string& name) {
  const auto has = [&](const std::vector<Edge>& edges) {
    return std::any_of(edges.begin(), edges.end(), [&](const Edge& edge) { return edge.name == name; });
  };
  if (has(piece.outline)) return &piece.outline;
  for (Hole& hole : piece.holes) {
    if (has(hole.edges)) return &hole.edges;
  }
  return nullptr;
}

std::vector<std::string> edge_names(const Piece& piece) {
  std::vector<std::string> names;
  for (const Edge& edge : piece.outline) names.push_back(edge.name);
  for (const Hole& hole : piece.holes) {
    for (const Edge& edge : hole.edges) names.push_back(edge.name);
  }
  return names;
}

}  // namespace

double in_metres(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::mm:
      return 1e-3;
    case LengthUnit::cm:
      return 1e-2;
    case LengthUnit::m:
      return 1;
    case LengthUnit::inch:
      return 0.0254;
  }
  return 1;
}

Result<Piece> split_edge(const Piece& source, LengthUnit units, const std::string& edge_name, const SplitAt& at,
                         const std::string& first, const std::string& second, double tolerance) {
  Piece piece = source;
  const auto issue = [&](const char* code, std::string what, std::string remedy) {
    return Issue{code, {.item = piece.name + "." + edge_name}, std::move(what), std::move(remedy)};
  };
  std::vector<Edge>* loop = loop_with_edge(piece, edge_name);
  if (!loop) return issue("unknown_edge", "there is no such edge to split", suggestion(edge_name, edge_names(piece)));
  const auto edge_at =
      std::find_if(loop->begin(), loop->end(), [&](const Edge& edge) { return edge.name == edge_name; });
  const Edge edge = *edge_at;
  for (const std::string& name : {first, second}) {
    const std::vector<std::string> names = edge_names(piece);
    const bool line =
        std::any_of(piece.lines.begin(), piece.lines.end(), [&](const InternalLine& l) { return l.name == name; });
    if (first == second || line || (name != edge_name && std::count(names.begin(), names.end(), name) > 0)) {
      return issue("duplicate_name", fmt::format("the name '{}' for one of the parts is used twice", name),
                   "give both parts names of their own");
    }
  }
  if (edge.segments.empty()) return issue("broken_edge", "it has no segments", "give it at least one line or curve");
  if (piece.fold == edge_name)
    return issue("split_fold", "it lies on the fold, which is one straight edge", "name a point on it instead");

  const Curve curve(edge.segments);
  const double scale = in_metres(units);
  double s = 0;
  const auto known = piece.points.find(at.point);
  if (at.distance) {
    s = *at.distance + (*at.distance < 0 ? curve.length() : 0);
  } else {
    if (!at.position && known == piece.points.end()) {
      std::vector<std::string> names;
      for (const auto& [name, p] : piece.points) names.push_back(name);
      return issue("unknown_point", fmt::format("there is no point '{}' to split at", at.point),
                   suggestion(at.point, names));
    }
    const Point2 wanted = at.position ? *at.position : known->second;
    const Curve::Nearest nearest = curve.nearest(wanted);
    if (!(nearest.distance * scale <= tolerance)) {
      return issue(
          "point_off_edge",
          fmt::format("point '{}' ({:.6g}, {:.6g}) is {:.4g} mm away from the edge", at.point, wanted.x(), wanted.y(),
                      nearest.distance * scale * 1e3),
          fmt::format("move it onto the edge (nearest: ({:.6g}, {:.6g}))", nearest.point.x(), nearest.point.y()));
    }
    s = nearest.s;
  }
  if (!(s * scale > 1e-6 && (curve.length() - s) * scale > 1e-6)) {
    return issue("split_at_end", fmt::format("it cannot be split at {:.6g} of its length {:.6g}", s, curve.length()),
                 "split between its ends");
  }
  const auto [before, after] = curve.split(s);
  const Point2 where = before.to();
  if (at.distance && known != piece.points.end() && !((known->second - where).norm() * scale <= tolerance)) {
    return issue("duplicate_name", fmt::format("there is a point '{}' elsewhere", at.point),
                 "choose another name for the point of the split");
  }
  piece.points[at.point] = where;
  Edge a = edge, b = edge;
  a.name = first;
  b.name = second;
  a.to = b.from = at.point;
  a.segments = before.segments();
  b.segments = after.segments();
  b.segments.front().from = where;
  for (Notch& notch : piece.notches) {
    if (notch.edge != edge_name) continue;
    double here = 0;
    if (notch.point) here = piece.points.count(*notch.point) ? curve.nearest(piece.points.at(*notch.point)).s : 0;
    if (notch.distance) here = *notch.distance + (*notch.distance < 0 ? curve.length() : 0);
    if (notch.fraction) here = *notch.fraction * curve.length();
    notch.edge = here <= s ? first : second;
    if (notch.point) continue;
    notch.fraction.reset();
    notch.distance = here <= s ? here : here - s;
  }
  *edge_at = std::move(a);
  loop->insert(edge_at + 1, std::move(b));
  return piece;
}

const PanelEdge* find_edge(const CutPanel& panel, std::string_view name) {
  for (const PanelEdge& edge : panel.outline) {
    if (edge.name == name) return &edge;
  }
  for (const PanelHole& hole : panel.holes) {
    for (const PanelEdge& edge : hole.edges) {
      if (edge.name == name) return &edge;
    }
  }
  return nullptr;
}

const CutPanel* find_panel(const std::vector<CutPanel>& panels, std::string_view name) {
  for (const CutPanel& panel : panels) {
    if (panel.name == name) return &panel;
  }
  return nullptr;
}

}  // namespace toile::pattern
