// What is probably not meant in a pattern that can be cut.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry.h"

namespace toile::pattern {
namespace {

constexpr double leg_difference = 1e-3;  // [m] ...
constexpr double leg_difference_share = 0.005;
constexpr double widest_dart = std::numbers::pi / 4;  // opening of what is taken for a dart [rad]
constexpr double along_distance = 2e-5;               // lines this near [m] ...
constexpr double along_length = 5e-3;                 // ... over so much lie on each other [m]
constexpr double short_of = 1e-3;                     // [m]

double cross(const Point2& a, const Point2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

struct Named {
  std::string name;
  Curve curve;
};

class PieceAdvice {
 public:
  PieceAdvice(const Pattern& pattern, const Piece& piece, Issues& issues)
      : pattern_(pattern),
        piece_(piece),
        issues_(issues),
        map_(metres_from_pattern(pattern)),
        scale_(in_metres(pattern.units)) {
    outline_ = curves(piece.outline);
    for (const Hole& hole : piece.holes) holes_.push_back(curves(hole.edges));
    for (const InternalLine& line : piece.lines) lines_.push_back({line.name, curve(line.segments)});
  }

  void run() {
    short_edges();
    outline_darts();
    for (const auto& hole : holes_) {
      if (hole.size() == 2) compare_legs(hole[0], hole[1]);
    }
    line_darts();
    lines_on_edges();
  }

 private:
  Curve curve(const std::vector<Segment>& segments) const {
    std::vector<Segment> mapped;
    for (const Segment& segment : segments) mapped.push_back(map_(segment));
    return Curve(std::move(mapped));
  }
  std::vector<Named> curves(const std::vector<Edge>& edges) const {
    std::vector<Named> result;
    for (const Edge& edge : edges) result.push_back({edge.name, curve(edge.segments)});
    return result;
  }
  void report(const char* code, const std::string& part, std::string what, std::string remedy) {
    issues_.push_back(
        Issue{code, {.item = piece_.name + "." + part}, std::move(what), std::move(remedy), Category::check});
  }
  std::string at(const Point2& metres) const {
    const double y = pattern_.y_down ? -metres.y() : metres.y();
    return fmt::format("({:.6g}, {:.6g})", metres.x() / scale_ + 0.0, y / scale_ + 0.0);
  }

  void short_edges() {
    const auto look = [&](const std::vector<Named>& edges) {
      for (const Named& edge : edges) {
        if (edge.curve.length() < 1e-3)
          report("short_edge", edge.name, fmt::format("it is only {:.3g} mm long", edge.curve.length() * 1e3),
                 "join it with its neighbour, unless it is meant");
      }
    };
    look(outline_);
    for (const auto& hole : holes_) look(hole);
  }

  void compare_legs(const Named& a, const Named& b) {
    const double la = a.curve.length(), lb = b.curve.length(), difference = std::abs(la - lb);
    if (difference <= leg_difference || difference <= leg_difference_share * std::max(la, lb)) return;
    report("dart_legs_differ", a.name,
           fmt::format("the legs of the dart differ: this one is {:.2f} mm long, '{}' {:.2f} mm", la * 1e3, b.name,
                       lb * 1e3),
           "draw them equally long, or sew them with ease");
  }

  /// Edges that run into the piece and straight out again.
  void outline_darts() {
    double area = 0;
    for (const Named& edge : outline_) area += edge.curve.sector_area();
    const std::size_t n = outline_.size();
    for (std::size_t i = 0; n > 2 && i < n; ++i) {
      const Named &a = outline_[i], &b = outline_[(i + 1) % n];
      const Point2 in = a.curve.tangent_at(a.curve.length()), out = b.curve.tangent_at(0);
      const double turn = std::atan2(cross(in, out), in.dot(out)), opening = std::numbers::pi - std::abs(turn);
      const double la = a.curve.length(), lb = b.curve.length();
      if ((turn < 0) == (area > 0) && opening < widest_dart && std::min(la, lb) > 0.8 * std::max(la, lb))
        compare_legs(a, b);
    }
  }

  /// Dart lines: closed ones with two tips, and pairs of open ones that share a tip.
  void line_darts() {
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (piece_.lines[i].kind != LineKind::dart) continue;
      const Curve& a = lines_[i].curve;
      if ((a.from() - a.to()).norm() <= on_edge_tolerance) {
        std::vector<double> tips;
        const double step = 1e-6 * a.length();
        for (std::size_t k = 0; k + 1 < a.segment_starts().size(); ++k) {
          const double s = a.segment_starts()[k];
          const Point2 here = a.point_at(s), in = here - a.point_at(k == 0 ? a.length() - step : s - step),
                       out = a.point_at(s + step) - here;
          if (std::abs(std::atan2(cross(in, out), in.dot(out))) > std::numbers::pi - widest_dart) tips.push_back(s);
        }
        if (tips.size() != 2) continue;
        const double la = tips[1] - tips[0], lb = a.length() - la, difference = std::abs(la - lb);
        if (difference > leg_difference && difference > leg_difference_share * std::max(la, lb))
          report("dart_legs_differ", lines_[i].name,
                 fmt::format("the legs of the dart differ: {:.2f} and {:.2f} mm", la * 1e3, lb * 1e3),
                 "draw them equally long, or sew them with ease");
        continue;
      }
      for (std::size_t j = i + 1; j < lines_.size(); ++j) {
        if (piece_.lines[j].kind != LineKind::dart) continue;
        const Curve& b = lines_[j].curve;
        for (const auto& [p, u] :
             {std::pair(a.from(), a.tangent_at(0)), std::pair(a.to(), Point2(-a.tangent_at(a.length())))}) {
          for (const auto& [q, w] :
               {std::pair(b.from(), b.tangent_at(0)), std::pair(b.to(), Point2(-b.tangent_at(b.length())))}) {
            if ((p - q).norm() > on_edge_tolerance || std::abs(std::atan2(cross(u, w), u.dot(w))) > widest_dart)
              continue;
            compare_legs(lines_[i], lines_[j]);
          }
        }
      }
    }
    // (Two legs that meet at both ends are told once.)
    const auto same = [](const Issue& a, const Issue& b) {
      return a.code == b.code && a.place.item == b.place.item && a.what == b.what;
    };
    issues_.erase(std::unique(issues_.begin(), issues_.end(), same), issues_.end());
  }

  void lines_on_edges() {
    std::vector<const Named*> others;
    for (const Named& edge : outline_) others.push_back(&edge);
    for (const auto& hole : holes_) {
      for (const Named& edge : hole) others.push_back(&edge);
    }
    const std::size_t edges = others.size();
    for (const Named& line : lines_) {
      const int steps = std::clamp(static_cast<int>(line.curve.length() / 1e-3), 20, 2000);
      const double step = line.curve.length() / steps;
      for (const Named* other : others) {
        int since = -1;
        for (int k = 0; k <= steps + 1; ++k) {
          if (k <= steps && other->curve.nearest(line.curve.point_at(k * step)).distance < along_distance) {
            if (since < 0) since = k;
            continue;
          }
          if (since >= 0 && (k - 1 - since) * step > along_length) {
            report("line_along_edge", line.name,
                   fmt::format("it lies on '{}' from {} to {} and cannot become an edge of the mesh", other->name,
                               at(line.curve.point_at(since * step)), at(line.curve.point_at((k - 1) * step))),
                   "move it, or use that edge");
            break;
          }
          since = -1;
        }
      }
      for (const Point2& end : {line.curve.from(), line.curve.to()}) {
        double nearest = short_of;
        const Named* edge = nullptr;
        for (std::size_t k = 0; k < edges; ++k) {
          const double distance = others[k]->curve.nearest(end).distance;
          if (distance < nearest) nearest = distance, edge = others[k];
        }
        if (edge && nearest > on_edge_tolerance)
          report("line_short_of_edge", line.name,
                 fmt::format("it ends at {}, {:.2f} mm before edge '{}'", at(end), nearest * 1e3, edge->name),
                 "let it end on the edge, or farther away");
        if ((line.curve.from() - line.curve.to()).norm() <= on_edge_tolerance) break;
      }
      others.push_back(&line);
    }
  }

  const Pattern& pattern_;
  const Piece& piece_;
  Issues& issues_;
  Similarity map_;
  double scale_;
  std::vector<Named> outline_, lines_;
  std::vector<std::vector<Named>> holes_;
};

/// Whether two pieces have the same outline up to a shift.
bool alike(const Piece& a, const Piece& b) {
  if (a.outline.size() != b.outline.size() || a.outline.empty() || a.fold.has_value() != b.fold.has_value() ||
      a.material != b.material)
    return false;
  const Point2 shift = b.outline.front().segments.front().from - a.outline.front().segments.front().from;
  for (std::size_t i = 0; i < a.outline.size(); ++i) {
    const Curve ca(a.outline[i].segments), cb(b.outline[i].segments);
    if (std::abs(ca.length() - cb.length()) > 1e-9 * ca.length()) return false;
    for (double share : {0.0, 0.31, 0.72}) {
      if ((ca.point_at(share * ca.length()) + shift - cb.point_at(share * cb.length())).norm() > 1e-6 * ca.length())
        return false;
    }
  }
  return true;
}

}  // namespace

Issues advice(const Pattern& pattern) {
  Issues issues;
  Pattern sound = pattern;
  std::erase_if(sound.pieces, [&](const Piece& piece) {
    Pattern alone = pattern;
    alone.pieces = {piece};
    return !check(alone).empty();
  });
  for (const Piece& piece : sound.pieces) PieceAdvice(sound, piece, issues).run();
  for (std::size_t i = 0; i < sound.pieces.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!alike(sound.pieces[j], sound.pieces[i])) continue;
      issues.push_back(Issue{"same_piece",
                             {.item = sound.pieces[i].name},
                             fmt::format("it has the same outline as piece '{}'", sound.pieces[j].name),
                             "cut one piece twice ('cut: 2'), or remove one",
                             Category::check});
      break;
    }
  }
  return issues;
}

}  // namespace toile::pattern
