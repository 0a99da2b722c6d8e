#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "geometry.h"
#include "toile/base/text.h"

namespace toile::pattern {
namespace {

constexpr double flat_tolerance = 1e-6;      // of polylines that stand for curves in the tests below [m]
constexpr double straight_tolerance = 1e-5;  // of a fold [m]
constexpr double touch_tolerance = 1e-8;     // closer than this, two parts of a border touch [m]

double cross(const Point2& a, const Point2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

bool good_name(std::string_view name) {
  if (name.empty() || !(std::isalpha(static_cast<unsigned char>(name.front())) || name.front() == '_')) return false;
  return std::all_of(name.begin(), name.end(),
                     [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-'; });
}

class PieceCheck {
 public:
  PieceCheck(const Pattern& pattern, const Piece& piece, Issues& issues)
      : pattern_(pattern),
        piece_(piece),
        issues_(issues),
        map_(metres_from_pattern(pattern)),
        scale_(in_metres(pattern.units)) {}

  void run() {
    check_names();
    if (piece_.copies < 1 || piece_.copies > 1000) {
      report("bad_copies", "", fmt::format("it is cut {} times", piece_.copies), "give a number from 1 to 1000");
    }
    if (piece_.outline.empty()) {
      report("empty_outline", "", "it has no outline", "list its edges in order round the piece");
      return;
    }
    check_border();
    check_holes();
    check_lines_and_marks();
    check_notches();
    check_grain();
    check_fold();
  }

 private:
  std::string item(const std::string& part) const { return part.empty() ? piece_.name : piece_.name + "." + part; }
  void report(const char* code, const std::string& part, std::string what, std::string remedy) {
    issues_.push_back(Issue{code, {.item = item(part)}, std::move(what), std::move(remedy), Category::check});
  }
  /// A position for people: in the pattern's own units and axes.
  std::string at(const Point2& metres) const {
    const double y = pattern_.y_down ? -metres.y() : metres.y();
    return fmt::format("({:.6g}, {:.6g})", metres.x() / scale_ + 0.0, y / scale_ + 0.0);
  }
  std::string length(double metres) const {
    static constexpr std::array names{"mm", "cm", "m", "inch"};
    return fmt::format("{:.4g} {}", metres / scale_, names[static_cast<std::size_t>(pattern_.units)]);
  }

  void check_names() {
    if (!good_name(piece_.name)) {
      report("bad_name", "", fmt::format("'{}' is no name for a piece", piece_.name),
             "use letters, digits, _ and -, starting with a letter");
    }
    std::set<std::string> lines, holes, notches, marks;
    const auto unique = [&](std::set<std::string>& names, const std::string& name, const char* what) {
      if (!good_name(name)) {
        report("bad_name", name, fmt::format("'{}' is no name for {}", name, what),
               "use letters, digits, _ and -, starting with a letter");
      }
      if (!names.insert(name).second)
        report("duplicate_name", name, fmt::format("the name '{}' is used twice", name),
               "give every edge and line a name of its own");
    };
    for (const auto& [name, p] : piece_.points) {
      if (!good_name(name))
        report("bad_name", name, fmt::format("'{}' is no name for a point", name),
               "use letters, digits, _ and -, starting with a letter");
      if (!p.allFinite()) report("broken_point", name, "its coordinates are not finite", "give two numbers");
    }
    for (const Edge& edge : piece_.outline) unique(lines, edge.name, "an edge");
    for (const Hole& hole : piece_.holes) {
      unique(holes, hole.name, "a hole");
      for (const Edge& edge : hole.edges) unique(lines, edge.name, "an edge");
    }
    for (const InternalLine& line : piece_.lines) unique(lines, line.name, "a line");
    for (const Notch& notch : piece_.notches) unique(notches, notch.name, "a notch");
    for (const Mark& mark : piece_.marks) unique(marks, mark.name, "a mark");
    if (!piece_.fold) return;
    const auto clash = [&](const std::set<std::string>& names) {
      for (const std::string& name : names) {
        if (names.count(name + "_m")) {
          report("duplicate_name", name + "_m", fmt::format("unfolding the piece gives '{}' this name too", name),
                 "names ending in _m belong to the mirrored half: choose another");
        }
      }
    };
    for (const auto* names : {&lines, &holes, &notches, &marks}) clash(*names);
    std::set<std::string> points;
    for (const auto& [name, p] : piece_.points) points.insert(name);
    clash(points);
  }

  /// Whether every segment is finite, long enough and starts where the one before ends.
  bool check_segments(const std::vector<Segment>& segments, const std::string& name, const char* zero_code) {
    if (segments.empty()) {
      report("broken_edge", name, "it has no segments", "give it at least one line or curve");
      return false;
    }
    for (std::size_t i = 0; i < segments.size(); ++i) {
      if (finite({segments[i]})) continue;
      report("broken_edge", name, fmt::format("segment {} has a number that is not finite", i + 1),
             "give finite coordinates");
      return false;
    }
    bool good = true;
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const Segment s = map_(segments[i]);
      if (Curve({s}).length() <= weld_tolerance) {
        report(zero_code, name, fmt::format("segment {} at {} has no length", i + 1, at(s.from)),
               "remove it, or move one of its ends");
        good = false;
      }
      if (i == 0) continue;
      const Point2 before = map_(segments[i - 1].to);
      if ((s.from - before).norm() > weld_tolerance) {
        report("broken_edge", name, fmt::format("it jumps from {} to {}", at(before), at(s.from)),
               "start each segment where the one before ends");
        good = false;
      }
    }
    return good;
  }

  /// A closed row of curves as far as it can be used: edges without a fault, and straight bridges over gaps.
  struct Loop {
    std::vector<Curve> curves;
    std::vector<std::string> names;  ///< of the edge that each curve is of; empty: a bridge
    Polyline line;
    double gap = 0;     ///< the widest that was bridged [m]
    bool whole = true;  ///< the curves are the edges, one for one
  };

  /// Checks the edges of a closed loop. What is wrong with one edge does not hide what is wrong with the others.
  std::optional<Loop> check_loop(const std::vector<Edge>& edges, const std::string& what) {
    Loop loop;
    std::vector<Segment> part;
    const auto end_part = [&](const std::string& name) {
      if (part.empty()) return;
      loop.curves.emplace_back(std::move(part));
      loop.names.push_back(name);
      part.clear();
    };
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const Edge& edge = edges[i];
      if (edge.allowance && !(*edge.allowance >= 0))
        report("bad_allowance", edge.name, "its seam allowance is negative", "give a length of 0 or more");
      loop.whole &= check_segments(edge.segments, edge.name, "zero_length_edge");
      if (!finite(edge.segments)) continue;
      const auto end = [&](const std::string& name, const Point2& p, const char* which) {
        const auto it = piece_.points.find(name);
        if (it == piece_.points.end()) {
          report("unknown_point", edge.name, fmt::format("its {} point '{}' does not exist", which, name),
                 suggestion(name, point_names()));
          loop.whole = false;
        } else if (const double gap = (map_(it->second) - map_(p)).norm(); !(gap <= weld_tolerance)) {
          report("edge_off_point", edge.name,
                 fmt::format("it {}s at {}, {} away from point '{}'", which, at(map_(p)), length(gap), name),
                 "let the edge meet its point");
          loop.whole = false;
        }
      };
      end(edge.from, edge.segments.front().from, "start");
      end(edge.to, edge.segments.back().to, "end");
      const Edge& next = edges[(i + 1) % edges.size()];
      if (finite(next.segments)) {
        const Point2 a = map_(edge.segments.back().to), b = map_(next.segments.front().from);
        if ((a - b).norm() > weld_tolerance) {
          report("open_outline", edge.name,
                 fmt::format("the {} is open: it ends at {}, the next edge '{}' starts at {}, {} away", what, at(a),
                             next.name, at(b), length((a - b).norm())),
                 "list the edges in order, each starting at the point where the one before ends");
          loop.whole = false;
        }
      }
      for (const Segment& segment : edge.segments) {
        const Segment s = map_(segment);
        if (Curve({s}).length() <= weld_tolerance) continue;
        if (!part.empty() && (part.back().to - s.from).norm() > weld_tolerance) end_part(edge.name);
        part.push_back(s);
      }
      end_part(edge.name);
    }
    if (loop.curves.empty()) return std::nullopt;
    if (!loop.whole) bridge(loop);
    loop.line = flatten(loop.curves, flat_tolerance);
    return loop;
  }

  static void bridge(Loop& loop) {
    Loop bridged{.gap = loop.gap, .whole = false};
    for (std::size_t i = 0; i < loop.curves.size(); ++i) {
      const Point2 a = loop.curves[i].to(), b = loop.curves[(i + 1) % loop.curves.size()].from();
      bridged.curves.push_back(loop.curves[i]);
      bridged.names.push_back(loop.names[i]);
      const double gap = (b - a).norm();
      if (gap <= weld_tolerance) continue;
      bridged.curves.emplace_back(std::vector<Segment>{line_segment(a, b)});
      bridged.names.emplace_back();
      bridged.gap = std::max(bridged.gap, gap);
    }
    loop = std::move(bridged);
  }

  static bool finite(const std::vector<Segment>& segments) {
    return !segments.empty() && std::all_of(segments.begin(), segments.end(), [](const Segment& s) {
      return s.from.allFinite() && s.to.allFinite() && s.control_1.allFinite() && s.control_2.allFinite() &&
             std::isfinite(s.bulge);
    });
  }

  std::vector<std::string> point_names() const {
    std::vector<std::string> names;
    for (const auto& [name, p] : piece_.points) names.push_back(name);
    return names;
  }

  /// Crossings and touches between the sides of closed polylines; one issue for each pair of edges.
  void check_crossings(const std::vector<const Loop*>& loops) {
    struct Side {
      double low, high;
      int loop, index;
    };
    std::vector<Side> sides;
    for (std::size_t l = 0; l < loops.size(); ++l) {
      const Polyline& line = loops[l]->line;
      for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
        const double x0 = line.points[i].x(), x1 = line.points[i + 1].x();
        sides.push_back({std::min(x0, x1) - touch_tolerance, std::max(x0, x1) + touch_tolerance, static_cast<int>(l),
                         static_cast<int>(i)});
      }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
      return std::tie(a.low, a.loop, a.index) < std::tie(b.low, b.loop, b.index);
    });
    std::set<std::pair<std::string, std::string>> told;
    const auto tell = [&](const Side& a, const Side& b, const Point2& where, const char* how) {
      const auto name = [&](const Side& s) {
        const Loop& loop = *loops[static_cast<std::size_t>(s.loop)];
        return loop.names[static_cast<std::size_t>(loop.line.curve[static_cast<std::size_t>(s.index)])];
      };
      std::string first = name(a), second = name(b);
      if (first.empty() || second.empty()) return;
      if (second < first) std::swap(first, second);
      if (!told.insert({first, second}).second) return;
      report("self_crossing", first,
             first == second ? fmt::format("it {} itself at {}", how, at(where))
                             : fmt::format("it {} edge '{}' at {}", how, second, at(where)),
             "redraw the edges so that they meet at their ends only");
    };
    for (std::size_t i = 0; i < sides.size(); ++i) {
      for (std::size_t j = i + 1; j < sides.size() && sides[j].low <= sides[i].high; ++j) {
        const Side &a = sides[i], &b = sides[j];
        const auto& pa = loops[static_cast<std::size_t>(a.loop)]->line.points;
        const auto& pb = loops[static_cast<std::size_t>(b.loop)]->line.points;
        const Point2 a0 = pa[static_cast<std::size_t>(a.index)], a1 = pa[static_cast<std::size_t>(a.index) + 1];
        const Point2 b0 = pb[static_cast<std::size_t>(b.index)], b1 = pb[static_cast<std::size_t>(b.index) + 1];
        if (std::max(a0.y(), a1.y()) + touch_tolerance < std::min(b0.y(), b1.y()) ||
            std::max(b0.y(), b1.y()) + touch_tolerance < std::min(a0.y(), a1.y()))
          continue;
        const int last = static_cast<int>(pa.size()) - 2;
        if (a.loop == b.loop && (std::abs(a.index - b.index) == 1 || std::abs(a.index - b.index) == last)) {
          // Neighbours share a point; only turning straight back makes them overlap.
          const bool a_first = b.index == a.index + 1 || (a.index == last && b.index == 0 && last > 1);
          const Point2 in = a_first ? Point2(a1 - a0) : Point2(b1 - b0),
                       out = a_first ? Point2(b1 - b0) : Point2(a1 - a0);
          const Point2 corner = a_first ? a1 : b1;
          if (in.dot(out) < 0 && std::abs(cross(in, out)) <= 1e-9 * in.norm() * out.norm())
            tell(a, b, corner, "turns back onto");
          continue;
        }
        const double d0 = cross(a1 - a0, b0 - a0), d1 = cross(a1 - a0, b1 - a0), d2 = cross(b1 - b0, a0 - b0),
                     d3 = cross(b1 - b0, a1 - b0);
        if (((d0 > 0) != (d1 > 0)) && ((d2 > 0) != (d3 > 0)) && d0 != d1) {
          tell(a, b, a0 + (a1 - a0) * (d2 / (d2 - d3)), "crosses");
        } else {
          for (const Point2& p : {b0, b1}) {
            if (distance_to_segment(p, a0, a1) <= touch_tolerance) tell(a, b, p, "touches");
          }
          for (const Point2& p : {a0, a1}) {
            if (distance_to_segment(p, b0, b1) <= touch_tolerance) tell(a, b, p, "touches");
          }
        }
      }
    }
  }

  void check_border() {
    border_ = check_loop(piece_.outline, "outline");
    if (!border_) return;
    double area = 0;
    for (const Curve& curve : border_->curves) area += curve.sector_area();
    if (std::abs(area) > 1e-8) return;
    // A figure of eight has none either; what is bridged, for a reason that has been told.
    const std::size_t before = issues_.size();
    check_crossings({&*border_});
    if (border_->whole && issues_.size() == before)
      report("no_area", "", "its outline encloses no area", "check the points of the outline");
    border_.reset();
  }

  void check_holes() {
    for (const Hole& hole : piece_.holes) {
      if (hole.edges.empty()) {
        report("empty_outline", hole.name, "the hole has no edges", "list its edges in order, or remove it");
        continue;
      }
      auto loop = check_loop(hole.edges, "hole");
      if (!loop) continue;
      if (border_) {
        for (const Point2& p : loop->line.points) {
          if (!winds_around(border_->line, p) && distance_to(border_->line, p) > border_->gap) {
            report("hole_outside", hole.name, fmt::format("the hole reaches outside the piece at {}", at(p)),
                   "keep it inside the outline");
            break;
          }
        }
      }
      holes_.push_back(std::move(*loop));
    }
    std::vector<const Loop*> loops;
    if (border_) loops.push_back(&*border_);
    for (const Loop& hole : holes_) loops.push_back(&hole);
    check_crossings(loops);
    for (std::size_t i = 0; i < holes_.size(); ++i) {
      for (std::size_t j = 0; j < holes_.size(); ++j) {
        if (i != j && winds_around(holes_[j].line, holes_[i].line.points.front())) {
          report("hole_outside", "",
                 fmt::format("a hole at {} lies inside another hole", at(holes_[i].line.points.front())),
                 "remove one of them");
        }
      }
    }
  }

  /// On the cloth, its border included.
  bool on_cloth(const Point2& p) const {
    const auto slack = [](const Loop& loop) { return std::max(loop.gap, on_edge_tolerance); };
    if (!winds_around(border_->line, p) && distance_to(border_->line, p) > slack(*border_)) return false;
    return std::none_of(holes_.begin(), holes_.end(), [&](const Loop& hole) {
      return winds_around(hole.line, p) && distance_to(hole.line, p) > slack(hole);
    });
  }

  void check_lines_and_marks() {
    for (const InternalLine& line : piece_.lines) {
      if (!check_segments(line.segments, line.name, "zero_length_line")) continue;
      if (!border_) continue;
      std::vector<Segment> segments;
      for (const Segment& segment : line.segments) segments.push_back(map_(segment));
      const Curve curve(std::move(segments));
      if (line.kind == LineKind::dart && (curve.to() - curve.from()).norm() <= on_edge_tolerance) {
        Loop loop{.curves = {curve}, .names = {line.name}};
        loop.line = flatten(loop.curves, flat_tolerance);
        check_crossings({&loop});
      }
      for (const Point2& p : flatten({curve}, 1e-5).points) {
        if (on_cloth(p)) continue;
        if (line.kind == LineKind::dart) {
          report("dart_outside", line.name, fmt::format("the dart leaves the cloth at {}", at(p)),
                 "move its tip onto the piece, end its legs at the border");
        } else {
          report("line_outside", line.name, fmt::format("the line leaves the cloth at {}", at(p)),
                 "end it at the border");
        }
        break;
      }
    }
    if (!border_) return;
    for (const Mark& mark : piece_.marks) {
      if (!mark.at.allFinite() || !on_cloth(map_(mark.at))) {
        report("mark_outside", mark.name, fmt::format("the mark at {} is not on the cloth", at(map_(mark.at))),
               "move it onto the piece");
      }
    }
  }

  void check_notches() {
    std::vector<std::string> names;
    for (const Edge& edge : piece_.outline) names.push_back(edge.name);
    for (const Hole& hole : piece_.holes) {
      for (const Edge& edge : hole.edges) names.push_back(edge.name);
    }
    for (const Notch& notch : piece_.notches) {
      const int given = notch.point.has_value() + notch.distance.has_value() + notch.fraction.has_value();
      if (given != 1) {
        report("bad_notch", notch.name, fmt::format("the notch is placed in {} ways", given),
               "give one of point, distance and fraction");
        continue;
      }
      const Edge* edge = nullptr;
      for (const Edge& e : piece_.outline) edge = e.name == notch.edge ? &e : edge;
      for (const Hole& hole : piece_.holes) {
        for (const Edge& e : hole.edges) edge = e.name == notch.edge ? &e : edge;
      }
      if (!edge) {
        report("unknown_edge", notch.name, fmt::format("the notch's edge '{}' does not exist", notch.edge),
               suggestion(notch.edge, names));
        continue;
      }
      if (!finite(edge->segments)) continue;
      std::vector<Segment> segments;
      for (const Segment& segment : edge->segments) {
        segments.push_back(map_(segment));
      }
      const Curve curve(std::move(segments));
      if (notch.point) {
        const auto it = piece_.points.find(*notch.point);
        if (it == piece_.points.end()) {
          report("unknown_point", notch.name, fmt::format("the notch's point '{}' does not exist", *notch.point),
                 suggestion(*notch.point, point_names()));
        } else if (const auto nearest = curve.nearest(map_(it->second)); !(nearest.distance <= on_edge_tolerance)) {
          report("notch_off_border", notch.name,
                 fmt::format("its point '{}' at {} is {} away from edge '{}'", *notch.point, at(map_(it->second)),
                             length(nearest.distance), notch.edge),
                 fmt::format("move it onto the edge (nearest: {})", at(nearest.point)));
        }
      } else if (notch.distance && !(std::abs(*notch.distance) * scale_ <= curve.length() * (1 + 1e-12))) {
        report("notch_off_border", notch.name,
               fmt::format("its distance {} is beyond the length {} of edge '{}'", length(*notch.distance * scale_),
                           length(curve.length()), notch.edge),
               "give a smaller distance");
      } else if (notch.fraction && !(*notch.fraction >= 0 && *notch.fraction <= 1)) {
        report("notch_off_border", notch.name, fmt::format("its fraction {} is not between 0 and 1", *notch.fraction),
               "give a fraction of the edge's length");
      }
    }
  }

  void check_grain() {
    if (!piece_.grain) {
      if (!piece_.fold)
        report("grain_missing", "", "it has no grain line", "draw one along the warp (or name the fold edge)");
      return;
    }
    const double size = (map_(piece_.grain->to) - map_(piece_.grain->from)).norm();
    if (!(size > weld_tolerance))
      report("grain_zero", "grain", "the grain line has no length", "give two different points");
  }

  void check_fold() {
    if (!piece_.fold) return;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < piece_.outline.size(); ++i) {
      const Edge& edge = piece_.outline[i];
      names.push_back(edge.name);
      if (edge.name != *piece_.fold) continue;
      if (!border_ || !border_->whole) return;  // already told what is wrong with the outline
      const Curve& curve = border_->curves[i];
      const Point2 a = curve.from(), d = curve.to() - a;
      if (piece_.outline.size() < 2 || !(d.norm() > weld_tolerance)) {
        report("fold_not_straight", edge.name, "the fold starts and ends at the same point",
               "the fold is one straight edge of several");
        return;
      }
      const Polyline fold = flatten({curve}, flat_tolerance);
      double along = 0;
      for (const Point2& p : fold.points) {
        const double off = std::abs(cross(d.normalized(), p - a)), here = (p - a).dot(d.normalized());
        if (off > straight_tolerance || here < along - straight_tolerance) {
          report("fold_not_straight", edge.name,
                 fmt::format("the fold is not straight: {} off its chord at {}", length(off), at(p)),
                 "only a straight edge can lie on the fold");
          return;
        }
        along = here;
      }
      double low = 0, high = 0;
      Point2 low_at = a, high_at = a;
      for (const Point2& p : border_->line.points) {
        const double side = cross(d.normalized(), p - a);
        if (side < low) low = side, low_at = p;
        if (side > high) high = side, high_at = p;
      }
      if (std::min(-low, high) > straight_tolerance) {
        report("piece_across_fold", edge.name,
               fmt::format("the piece lies on both sides of the fold (to {} and {})", at(low_at), at(high_at)),
               "draw the half on one side only");
      }
      return;
    }
    report("unknown_edge", "fold", fmt::format("the fold edge '{}' is not in the outline", *piece_.fold),
           suggestion(*piece_.fold, names));
  }

  const Pattern& pattern_;
  const Piece& piece_;
  Issues& issues_;
  Similarity map_;
  double scale_;
  std::optional<Loop> border_;
  std::vector<Loop> holes_;
};

}  // namespace

Issues check(const Pattern& pattern) {
  Issues issues;
  if (pattern.pieces.empty())
    issues.push_back(Issue{"no_pieces", {}, "the pattern has no pieces", "draw at least one", Category::check});
  std::set<std::string> names;
  for (const Piece& piece : pattern.pieces) {
    const int copies = std::clamp(piece.copies, 1, 1000);
    for (int copy = 0; copy < copies; ++copy) {
      const std::string name = panel_name(piece, copy);
      if (names.insert(name).second) continue;
      issues.push_back(Issue{"duplicate_name",
                             {.item = piece.name},
                             fmt::format("two panels would be called '{}'", name),
                             "give the pieces other names",
                             Category::check});
      break;
    }
    PieceCheck(pattern, piece, issues).run();
  }
  return issues;
}

}  // namespace toile::pattern
