#include "line_network.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>

namespace toile::tailor {
namespace {

using pattern::Curve;

constexpr double same_point = 1e-6;                    ///< [m]
constexpr double touch = pattern::on_edge_tolerance;   ///< lines this near at an end or corner meet there [m]
constexpr double on_line = 2e-5;                       ///< lines this near ... [m]
constexpr double on_line_length = 5e-3;                ///< ... for so long run on each other [m]

double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }

/// A curve as a row of points with their arc lengths.
struct Row {
  std::vector<double> s;
  std::vector<Point> p;
  Point low = Point::Constant(std::numeric_limits<double>::infinity()), high = -low;
};

Row row_of(const Curve& curve) {
  Row row;
  row.s = curve.sample(1e-5);
  for (double s : row.s) {
    row.p.push_back(curve.point_at(s));
    row.low = row.low.cwiseMin(row.p.back());
    row.high = row.high.cwiseMax(row.p.back());
  }
  return row;
}

bool apart(const Row& a, const Row& b, double margin) { return ((a.low - b.high).array() > margin).any() || ((b.low - a.high).array() > margin).any(); }

double distance_to(const Row& row, const Point& p) {
  double best_sq = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < row.p.size(); ++i) {
    const Point d = row.p[i + 1] - row.p[i], e = p - row.p[i];
    const double length_sq = d.squaredNorm(), t = length_sq > 0 ? std::clamp(e.dot(d) / length_sq, 0.0, 1.0) : 0.0;
    best_sq = std::min(best_sq, (e - t * d).squaredNorm());
  }
  return std::sqrt(best_sq);
}

/// Arc lengths (on a, on b) at which two curves cross. With the same curve twice: where it crosses itself.
std::vector<std::pair<double, double>> crossings(const Curve& a, const Row& row_a, const Curve& b, const Row& row_b, bool same) {
  std::vector<std::pair<double, double>> result;
  for (std::size_t i = 0; i + 1 < row_a.p.size(); ++i) {
    const Point a0 = row_a.p[i], a1 = row_a.p[i + 1];
    if ((a0.cwiseMax(a1).array() < row_b.low.array()).any() || (a0.cwiseMin(a1).array() > row_b.high.array()).any()) continue;
    for (std::size_t j = same ? i + 2 : 0; j + 1 < row_b.p.size(); ++j) {
      const Point b0 = row_b.p[j], b1 = row_b.p[j + 1];
      if (std::max(a0.x(), a1.x()) < std::min(b0.x(), b1.x()) || std::max(b0.x(), b1.x()) < std::min(a0.x(), a1.x()) || std::max(a0.y(), a1.y()) < std::min(b0.y(), b1.y()) ||
          std::max(b0.y(), b1.y()) < std::min(a0.y(), a1.y())) {
        continue;
      }
      const double d0 = cross(a1 - a0, b0 - a0), d1 = cross(a1 - a0, b1 - a0), d2 = cross(b1 - b0, a0 - b0), d3 = cross(b1 - b0, a1 - b0);
      if ((d0 > 0) == (d1 > 0) || (d2 > 0) == (d3 > 0) || d0 == d1 || d2 == d3) continue;
      double s = row_a.s[i] + (row_a.s[i + 1] - row_a.s[i]) * d2 / (d2 - d3), t = row_b.s[j] + (row_b.s[j + 1] - row_b.s[j]) * d0 / (d0 - d1);
      // From the chords to the curves.
      for (int step = 0; step < 20; ++step) {
        const Point gap = b.point_at(t) - a.point_at(s), u = a.tangent_at(s), w = b.tangent_at(t);
        const double determinant = cross(u, w);
        if (gap.norm() < 1e-13 || std::abs(determinant) < 1e-6) break;
        s = std::clamp(s + cross(gap, w) / determinant, 0.0, a.length());
        t = std::clamp(t + cross(gap, u) / determinant, 0.0, b.length());
      }
      if (same && std::abs(s - t) < same_point) continue;
      if ((b.point_at(t) - a.point_at(s)).norm() < on_line) result.emplace_back(s, t);
    }
  }
  return result;
}

/// Something that must be a vertex at a place of a line.
struct Request {
  double s = 0;
  int group = 0;
  bool hard = true;  ///< exactly here; the others may join a neighbour within `touch`
};

class Builder {
 public:
  Builder(const pattern::CutPanel& panel, double corner) : panel_(panel), corner_(corner) {
    const auto add_loop = [&](const std::vector<pattern::PanelEdge>& edges) {
      net_.loops.emplace_back();
      for (const auto& edge : edges) {
        net_.loops.back().push_back(static_cast<int>(net_.lines.size()));
        net_.lines.push_back({edge.curve, edge.name, false, false, edge.allowance, {}});
      }
    };
    add_loop(panel.outline);
    for (const auto& hole : panel.holes) add_loop(hole.edges);
    net_.border_lines = net_.lines.size();
    for (const auto& line : panel.lines) net_.lines.push_back({line.curve, line.name, true, line.reflected, 0, {}});
    for (const NetworkLine& line : net_.lines) rows_.push_back(row_of(line.curve));
    requests_.resize(net_.lines.size());
  }

  Result<LineNetwork> run() {
    ends_and_corners();
    check_border();
    for (std::size_t l = net_.border_lines; l < net_.lines.size(); ++l) meet(l);
    if (!issues_.empty()) return issues_;
    named_points();
    for (std::size_t l = 0; l < net_.lines.size(); ++l) cluster(l);
    number_nodes();
    return std::move(net_);
  }

 private:
  int new_group() {
    parent_.push_back(static_cast<int>(parent_.size()));
    return parent_.back();
  }
  int root(int group) {
    while (parent_[static_cast<std::size_t>(group)] != group) group = parent_[static_cast<std::size_t>(group)] = parent_[static_cast<std::size_t>(parent_[static_cast<std::size_t>(group)])];
    return group;
  }
  void unite(int a, int b) {
    a = root(a);
    b = root(b);
    parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  }
  void ask(std::size_t line, double s, int group, bool hard) { requests_[line].push_back({s, group, hard}); }

  std::string place(const Point& p) const { return fmt::format("({:.2f}, {:.2f}) cm", p.x() * 100, p.y() * 100); }
  std::string item(std::size_t line) const { return panel_.name + "." + net_.lines[line].name; }
  const char* what(std::size_t line) const { return net_.lines[line].internal ? "line" : "edge"; }

  void ends_and_corners() {
    for (const auto& loop : net_.loops) {
      std::vector<int> groups;
      for (std::size_t k = 0; k < loop.size(); ++k) groups.push_back(new_group());
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const auto l = static_cast<std::size_t>(loop[k]);
        ask(l, 0, groups[k], true);
        ask(l, net_.lines[l].curve.length(), groups[(k + 1) % loop.size()], true);
      }
    }
    for (std::size_t l = net_.border_lines; l < net_.lines.size(); ++l) {
      const Curve& curve = net_.lines[l].curve;
      const int first = new_group();
      ask(l, 0, first, true);
      ask(l, curve.length(), (curve.to() - curve.from()).norm() <= touch ? first : new_group(), true);
    }
    for (std::size_t l = 0; l < net_.lines.size(); ++l) {
      const Curve& curve = net_.lines[l].curve;
      const auto& starts = curve.segment_starts();
      for (std::size_t k = 1; k + 1 < starts.size(); ++k) {
        const Point before = pattern::derivative(curve.segments()[k - 1], 1), after = pattern::derivative(curve.segments()[k], 0);
        if (std::abs(std::atan2(cross(before, after), before.dot(after))) > corner_) ask(l, starts[k], new_group(), true);
      }
    }
  }

  /// Holes that were cut out must lie apart from each other and from the outline; drawn ones are checked with the pattern.
  void check_border() {
    for (std::size_t i = 0; i < net_.loops.size(); ++i) {
      for (std::size_t j = i; j < net_.loops.size(); ++j) {
        for (int a : net_.loops[i]) {
          for (int b : net_.loops[j]) {
            const bool neighbours = i == j && (b == a + 1 || (a == net_.loops[i].front() && b == net_.loops[i].back() && a != b));
            if ((i == j && b < a) || neighbours) continue;
            const auto la = static_cast<std::size_t>(a), lb = static_cast<std::size_t>(b);
            if (apart(rows_[la], rows_[lb], same_point)) continue;
            std::optional<Point> where;
            for (const auto& [s, t] : crossings(net_.lines[la].curve, rows_[la], net_.lines[lb].curve, rows_[lb], a == b)) {
              const double length = net_.lines[la].curve.length();
              if (a == b && std::min(s, length - s) < touch && std::min(t, length - t) < touch) continue;
              if ((net_.lines[la].curve.point_at(s) - net_.lines[lb].curve.point_at(t)).norm() < 1e-9) where = net_.lines[la].curve.point_at(s);
            }
            if (i != j && !where) {
              for (const Point& p : rows_[lb].p) {
                if (distance_to(rows_[la], p) <= same_point) where = p;
              }
            }
            if (where) issues_.push_back({"cut_crosses", {.item = item(lb)}, fmt::format("cut out, it meets edge '{}' at {}", net_.lines[la].name, place(*where)), "cut-outs lie inside the cloth, apart from each other; draw this one as part of the outline", Category::check});
          }
        }
      }
    }
  }

  /// Contacts of an internal line with itself and with the lines before it.
  void meet(std::size_t l) {
    const Curve& curve = net_.lines[l].curve;
    for (const auto& [s, t] : crossings(curve, rows_[l], curve, rows_[l], true)) {
      const bool at_end = std::min(s, curve.length() - s) < touch && std::min(t, curve.length() - t) < touch;
      if (at_end) continue;
      const int group = new_group();
      ask(l, s, group, false);
      ask(l, t, group, false);
    }
    for (std::size_t m = 0; m < l; ++m) {
      if (apart(rows_[l], rows_[m], touch)) continue;
      std::vector<std::pair<double, double>> touches;
      if (along(l, m, touches)) continue;
      const Curve& other = net_.lines[m].curve;
      const auto contact = [&](double s, double t) {
        const int group = new_group();
        ask(l, s, group, false);
        ask(m, t, group, false);
      };
      for (const auto& [s, t] : crossings(curve, rows_[l], other, rows_[m], false)) contact(s, t);
      // Ends and corners of either on the other.
      for (const Request& request : std::vector<Request>(requests_[l])) {
        if (!request.hard) continue;
        const auto nearest = other.nearest(curve.point_at(request.s));
        if (nearest.distance <= touch) contact(request.s, nearest.s);
      }
      for (const Request& request : std::vector<Request>(requests_[m])) {
        if (!request.hard) continue;
        const auto nearest = curve.nearest(other.point_at(request.s));
        if (nearest.distance <= touch) contact(nearest.s, request.s);
      }
      // What comes first decides where a place is: what was found on chords comes last.
      for (const auto& [s, t] : touches) contact(s, t);
    }
  }

  /// Whether the line runs on another for a while; places where it only comes near are added to `touches`.
  bool along(std::size_t l, std::size_t m, std::vector<std::pair<double, double>>& touches) {
    const Curve& curve = net_.lines[l].curve;
    const int steps = std::max(20, static_cast<int>(std::ceil(curve.length() / 5e-4)));
    std::vector<double> distances;
    for (int k = 0; k <= steps; ++k) distances.push_back(distance_to(rows_[m], curve.point_at(curve.length() * k / steps)));
    const double step = curve.length() / steps;
    int since = -1;
    for (int k = 0; k <= steps + 1; ++k) {
      if (k <= steps && distances[static_cast<std::size_t>(k)] < on_line) {
        if (since < 0) since = k;
        continue;
      }
      // (A line shorter than that runs on another if all of it does.)
      if (since >= 0 && ((k - 1 - since) * step > on_line_length || (since == 0 && k > steps))) {
        issues_.push_back({"line_along_line", {.item = item(l)}, fmt::format("it runs along {} '{}' from {} to {}", what(m), net_.lines[m].name, place(curve.point_at(since * step)), place(curve.point_at((k - 1) * step))),
                           "leave it out, or move it off that line"});
        return true;
      }
      since = -1;
    }
    for (int k = 1; k < steps; ++k) {
      const double d = distances[static_cast<std::size_t>(k)];
      if (d > touch + step || d > distances[static_cast<std::size_t>(k - 1)] || d >= distances[static_cast<std::size_t>(k + 1)]) continue;
      // The lowest distance near here.
      double low = (k - 1) * step, high = (k + 1) * step;
      for (int round = 0; round < 60; ++round) {
        const double a = low + (high - low) / 3, b = high - (high - low) / 3;
        if (distance_to(rows_[m], curve.point_at(a)) < distance_to(rows_[m], curve.point_at(b))) high = b;
        else low = a;
      }
      const double s = 0.5 * (low + high);
      const auto nearest = net_.lines[m].curve.nearest(curve.point_at(s));
      if (nearest.distance <= touch) touches.emplace_back(s, nearest.s);
    }
    return false;
  }

  void named_points() {
    std::set<std::string> used;
    const auto on_lines = [&](const Point& at) -> std::optional<std::pair<std::size_t, double>> {
      std::optional<std::pair<std::size_t, double>> best;
      double nearest = touch;
      for (std::size_t l = 0; l < net_.lines.size(); ++l) {
        if (((rows_[l].low - at).array() > nearest).any() || ((at - rows_[l].high).array() > nearest).any()) continue;
        const auto found = net_.lines[l].curve.nearest(at);
        if (found.distance < nearest) nearest = found.distance, best = {l, found.s};
      }
      return best;
    };
    const auto name = [&](const std::string& text, const std::optional<std::pair<std::size_t, double>>& where, const Point& at) {
      if (!used.insert(text).second) return;
      int group = new_group();
      if (where) {
        ask(where->first, where->second, group, true);
      } else {
        const auto same = std::find_if(loose_.begin(), loose_.end(), [&](const auto& other) { return (other.second - at).norm() <= touch; });
        if (same != loose_.end()) group = same->first;
        else loose_.emplace_back(group, at);
      }
      named_.emplace_back(text, group);
    };
    for (const auto& point : panel_.points) {
      // Construction points off the lines are of no use to the garment.
      if (const auto where = on_lines(point.at)) name(point.name, where, point.at);
    }
    for (const auto& notch : panel_.notches) {
      for (std::size_t l = 0; l < net_.border_lines; ++l) {
        if (net_.lines[l].name == notch.edge) name(notch.name, std::pair{l, notch.s}, notch.at);
      }
    }
    for (const auto& mark : panel_.marks) name(mark.name, on_lines(mark.at), mark.at);
  }

  /// Requests of a line that are one place; what is asked for first decides where it is.
  void cluster(std::size_t l) {
    struct Place {
      double s;
      int group;
    };
    std::vector<Place> places;
    const auto join = [&](const Request& request, double tolerance) {
      const Place* best = nullptr;
      for (const Place& known : places) {
        if (std::abs(known.s - request.s) <= tolerance && (!best || std::abs(known.s - request.s) < std::abs(best->s - request.s))) best = &known;
      }
      if (best) unite(best->group, request.group);
      else places.push_back({request.s, request.group});
    };
    for (const Request& request : requests_[l]) {
      if (request.hard) join(request, same_point);
    }
    for (const Request& request : requests_[l]) {
      if (!request.hard) join(request, touch);
    }
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.s < b.s; });
    for (const Place& known : places) net_.lines[l].nodes.emplace_back(known.s, known.group);
  }

  /// From groups to nodes. A node on the border is where the border is.
  void number_nodes() {
    std::vector<int> number(parent_.size(), -1);
    for (NetworkLine& line : net_.lines) {
      std::vector<std::pair<double, int>> nodes;
      for (const auto& [s, group] : line.nodes) {
        int& id = number[static_cast<std::size_t>(root(group))];
        if (id < 0) {
          id = static_cast<int>(net_.nodes.size());
          net_.nodes.push_back(line.curve.point_at(s));
        }
        // Two places of a line that other lines draw together are one.
        if (!nodes.empty() && nodes.back().second == id && s - nodes.back().first <= 3 * touch) {
          if (s == line.curve.length()) nodes.back().first = s;
          continue;
        }
        nodes.emplace_back(s, id);
      }
      line.nodes = std::move(nodes);
    }
    for (const auto& [group, at] : loose_) {
      int& id = number[static_cast<std::size_t>(root(group))];
      if (id >= 0) continue;
      id = static_cast<int>(net_.nodes.size());
      net_.nodes.push_back(at);
    }
    for (const auto& [text, group] : named_) net_.points.emplace_back(text, number[static_cast<std::size_t>(root(group))]);
  }

  const pattern::CutPanel& panel_;
  double corner_;
  LineNetwork net_;
  std::vector<Row> rows_;
  std::vector<std::vector<Request>> requests_;  ///< by line
  std::vector<int> parent_;                     ///< of groups
  std::vector<std::pair<int, Point>> loose_;    ///< groups that are on no line
  std::vector<std::pair<std::string, int>> named_;
  Issues issues_;
};

bool inside(const std::vector<pattern::PanelEdge>& loop, const Point& p) {
  int winding = 0;
  for (const auto& edge : loop) {
    const Row row = row_of(edge.curve);
    for (std::size_t i = 0; i + 1 < row.p.size(); ++i) {
      const Point a = row.p[i] - p, b = row.p[i + 1] - p;
      if (a.y() <= 0 && b.y() > 0 && cross(a, b) > 0) ++winding;
      if (a.y() > 0 && b.y() <= 0 && cross(a, b) < 0) --winding;
    }
  }
  return winding != 0;
}

/// The parts of a line that lie in no hole.
std::vector<pattern::PanelLine> clipped(const pattern::CutPanel& panel, const pattern::PanelLine& whole, const NetworkLine& line) {
  std::vector<std::pair<double, double>> parts;
  bool open = false;
  for (std::size_t k = 0; k + 1 < line.nodes.size(); ++k) {
    const double s0 = line.nodes[k].first, s1 = line.nodes[k + 1].first;
    const Point middle = line.curve.point_at(0.5 * (s0 + s1));
    const bool gone = std::any_of(panel.holes.begin(), panel.holes.end(), [&](const auto& hole) { return inside(hole.edges, middle); });
    if (!gone && open) parts.back().second = s1;
    if (!gone && !open) parts.emplace_back(s0, s1);
    open = !gone;
  }
  if (parts.size() == 1 && parts[0].first == 0 && parts[0].second == line.curve.length()) return {whole};
  std::vector<pattern::PanelLine> result;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    result.push_back({parts.size() == 1 ? whole.name : fmt::format("{}_{}", whole.name, k + 1), whole.kind, whole.curve.part(parts[k].first, parts[k].second), whole.reflected});
  }
  return result;
}

}  // namespace

Result<LineNetwork> line_network(const pattern::CutPanel& panel, double corner) { return Builder(panel, corner).run(); }

Result<pattern::CutPanel> clip_lines(const pattern::CutPanel& panel, double corner) {
  if (panel.holes.empty()) return panel;
  pattern::CutPanel result = panel;
  result.lines.clear();
  Issues issues;
  // One by one: lines may run on each other where there is no cloth.
  for (const auto& line : panel.lines) {
    pattern::CutPanel alone = panel;
    alone.lines = {line};
    const auto net = line_network(alone, corner);
    if (!net) {
      append(issues, net.issues());
      continue;
    }
    for (auto& part : clipped(panel, line, net->lines.back())) result.lines.push_back(std::move(part));
  }
  if (!issues.empty()) return issues;
  return result;
}

}  // namespace toile::tailor
