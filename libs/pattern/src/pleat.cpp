#include "toile/pattern/pleat.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "geometry.h"
#include "toile/base/text.h"

namespace toile::pattern {
namespace {

double cross(const Point2& a, const Point2& b) { return a.x() * b.y() - a.y() * b.x(); }

Similarity inverse(const Similarity& map) {
  Similarity back;
  back.linear = map.linear.inverse();
  back.offset = -(back.linear * map.offset);
  return back;
}

Similarity shifted(const Point2& by) {
  Similarity map;
  map.offset = by;
  return map;
}

/// Reflection about the line through p with unit normal n.
Similarity reflected(const Point2& p, const Point2& n) {
  Similarity map;
  map.linear = Eigen::Matrix2d::Identity() - 2 * n * n.transpose();
  map.offset = 2 * n.dot(p) * n;
  return map;
}

/// An edge in metres, y up, counter-clockwise round the piece.
struct WorkEdge {
  std::string name, from, to;
  Curve curve;
};

/// One visible and one hidden fold. In its frame x runs across, along the edge's direction, from where the fold is laid.
struct Knife {
  std::string tag;    ///< 1, 2, ... of knife pleats, 1a, 1b, ... of the others
  double s = 0;       ///< along the edge as it is drawn [m]
  bool ahead = true;  ///< the visible fold looks in the edge's direction: outer fold at 0, inner at depth, laid on at 2 depth; otherwise the other way round
  Point2 origin, inwards, across;  ///< of x = 0 on the edge as it is drawn
  // Where cloth is let in: the place on the border opposite, and the border beside both ends that is repeated in the pleat.
  std::size_t far_edge = 0;
  double far_s = 0;
  Point2 shift = Point2::Zero();  ///< of everything before it on the edge
};

/// Arc lengths at which a curve meets the line through o with normal n.
std::vector<double> crossings(const Curve& curve, const Point2& o, const Point2& n) {
  const auto height = [&](double s) { return n.dot(curve.point_at(s) - o); };
  std::vector<double> result;
  const std::vector<double> samples = curve.sample(1e-4);
  double before = height(samples.front());
  if (before == 0) result.push_back(samples.front());
  for (std::size_t k = 1; k < samples.size(); ++k) {
    const double after = height(samples[k]);
    if (after == 0) {
      result.push_back(samples[k]);
    } else if (before != 0 && (before < 0) != (after < 0)) {
      double low = samples[k - 1], high = samples[k];
      while (true) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high) break;
        ((height(middle) < 0) == (before < 0) ? low : high) = middle;
      }
      result.push_back(std::abs(height(low)) <= std::abs(height(high)) ? low : high);
    }
    before = after;
  }
  return result;
}

std::optional<double> nearest_crossing(const Curve& curve, const Point2& o, const Point2& n, double s) {
  std::vector<double> found = crossings(curve, o, n);
  // An end that the line just misses.
  for (double end : {0.0, curve.length()}) {
    if (std::abs(n.dot(curve.point_at(end) - o)) < weld_tolerance) found.push_back(end);
  }
  std::optional<double> best;
  for (double at : found) {
    if (!best || std::abs(at - s) < std::abs(*best - s)) best = at;
  }
  return best;
}

class Pleater {
 public:
  Pleater(const Pattern& pattern, const Piece& piece, const PleatSpec& spec, std::size_t index)
      : piece_(piece), spec_(spec), index_(index), metres_(metres_from_pattern(pattern)), pattern_from_metres_(inverse(metres_)) {}

  Issues run() {
    read();
    if (const auto trouble = place(); !trouble.empty()) return trouble;
    if (spec_.spread) {
      if (const auto trouble = let_in(); !trouble.empty()) return trouble;
    }
    return draw();
  }

  Piece piece_;
  std::vector<PleatPart> parts_;

 private:
  Issue issue(std::string code, std::string what, std::string remedy) const {
    return Issue{std::move(code), {.item = "pleats " + spec_.name}, std::move(what), std::move(remedy), Category::check};
  }
  std::string edge_text() const { return piece_.name + "." + spec_.edge; }

  void read() {
    double area = 0;
    for (const Edge& edge : piece_.outline) {
      std::vector<Segment> segments;
      for (const Segment& segment : edge.segments) segments.push_back(metres_(segment));
      outline_.push_back({edge.name, edge.from, edge.to, Curve(std::move(segments))});
      area += outline_.back().curve.sector_area();
    }
    turned_ = area < 0;
    if (turned_) {
      std::reverse(outline_.begin(), outline_.end());
      for (WorkEdge& edge : outline_) edge = {edge.name, edge.to, edge.from, edge.curve.reversed()};
    }
    // The edge comes first.
    const auto own = std::find_if(outline_.begin(), outline_.end(), [&](const WorkEdge& edge) { return edge.name == spec_.edge; });
    first_ = own - outline_.begin();
    std::rotate(outline_.begin(), own, outline_.end());
  }

  /// Where the pleats go on the edge.
  Issues place() {
    const Curve& curve = outline_.front().curve;
    if (piece_.fold == spec_.edge) return {issue("pleat_on_fold", "this edge is the fold of the cloth", "lay the pleats along another edge")};
    double start = spec_.at;
    if (spec_.from) {
      const auto point = piece_.points.find(*spec_.from);
      if (point == piece_.points.end()) {
        std::vector<std::string> names;
        for (const auto& [name, p] : piece_.points) names.push_back(name);
        return {issue("unknown_point", fmt::format("the piece has no point '{}'", *spec_.from), suggestion(*spec_.from, names))};
      }
      const auto nearest = curve.nearest(metres_(point->second));
      if (nearest.distance > on_edge_tolerance) return {issue("point_off_edge", fmt::format("the point '{}' lies {:.2f} mm off {}", *spec_.from, nearest.distance * 1e3, edge_text()), "name a point on the edge")};
      start += nearest.s;
    }
    const bool pair = spec_.direction == PleatDirection::box || spec_.direction == PleatDirection::inverted;
    const double front = spec_.direction == PleatDirection::box ? 2 * spec_.depth : 0;
    if (spec_.count > 1 && spec_.width < front * (1 - 1e-9)) return {issue("narrow_pleats", fmt::format("box pleats {:.1f} mm deep are {:.1f} mm wide and cannot come every {:.1f} mm", spec_.depth * 1e3, front * 1e3, spec_.width * 1e3), "give them more width or less depth")};
    Point2 warp(0, 1);
    if (piece_.grain) {
      warp = metres_.linear * (piece_.grain->to - piece_.grain->from);
    } else if (piece_.fold) {
      const auto fold = std::find_if(outline_.begin(), outline_.end(), [&](const WorkEdge& edge) { return edge.name == *piece_.fold; });
      warp = fold->curve.to() - fold->curve.from();
    }
    warp.normalize();

    double taken = 0;  // by the pleats before, where the cloth for them is there already
    for (int k = 0; k < spec_.count; ++k) {
      for (int half = 0; half < (pair ? 2 : 1); ++half) {
        Knife knife;
        knife.tag = fmt::format("{}{}", k + 1, pair ? (half == 0 ? "a" : "b") : "");
        // Of a box the first fold looks back, of an inverted pleat the second.
        if (pair) knife.ahead = (half == 0) == (spec_.direction == PleatDirection::inverted);
        else knife.ahead = spec_.direction == PleatDirection::left;
        knife.s = start + k * spec_.width + half * front + taken;
        if (!spec_.spread) taken += 2 * spec_.depth;
        const double least = spec_.spread && knife.ahead ? spec_.depth : 0, most = curve.length() - (spec_.spread ? (knife.ahead ? 0 : spec_.depth) : 2 * spec_.depth);
        if (knife.s < least - weld_tolerance || knife.s > most + weld_tolerance) {
          return {issue("pleat_off_edge", fmt::format("pleat {} at {:.1f} mm, {:.1f} mm deep, does not find room on {}, which is {:.1f} mm long", knife.tag, knife.s * 1e3, spec_.depth * 1e3, edge_text(), curve.length() * 1e3), "move the pleats, or make them fewer or less deep")};
        }
        knife.s = std::clamp(knife.s, 0.0, curve.length());
        knife.origin = curve.point_at(knife.s);
        const Point2 tangent = curve.tangent_at(knife.s), normal(-tangent.y(), tangent.x());
        knife.inwards = spec_.along == PleatLine::grain ? warp : normal;
        if (knife.inwards.dot(normal) < 0) knife.inwards = -knife.inwards;
        // From the cloth's inside the edge runs to the right of the inward direction.
        knife.across = {knife.inwards.y(), -knife.inwards.x()};
        if (std::abs(tangent.dot(knife.across)) < 0.2) return {issue("pleat_off_edge", fmt::format("{} runs along the grain at pleat {}", edge_text(), knife.tag), "take `along: square`, or another edge")};
        knives_.push_back(std::move(knife));
      }
    }
    return {};
  }

  struct Hit {
    std::size_t edge = 0;
    double s = 0, distance = 0;
  };
  /// Where the line from o inwards leaves the piece.
  std::optional<Hit> opposite(const Point2& o, const Point2& inwards) const {
    const Point2 n(inwards.y(), -inwards.x());
    std::optional<Hit> best;
    for (std::size_t e = 0; e < outline_.size(); ++e) {
      for (double s : crossings(outline_[e].curve, o, n)) {
        const double distance = inwards.dot(outline_[e].curve.point_at(s) - o);
        if (distance > 1e-4 && (!best || distance < best->distance)) best = Hit{e, s, distance};
      }
    }
    return best;
  }

  /// The border beside a pleat that its hidden cloth repeats: from x = -depth to 0 where it looks ahead, otherwise from 0
  /// to depth. Runs in the direction of x.
  std::optional<Curve> beside(const Knife& knife, std::size_t e, double s) const {
    const Curve& curve = outline_[e].curve;
    const double side = knife.ahead ? -spec_.depth : spec_.depth;
    const auto end = nearest_crossing(curve, knife.origin + side * knife.across, knife.across, s);
    if (!end || std::abs(*end - s) < weld_tolerance) return std::nullopt;
    const Curve part = curve.part(std::min(s, *end), std::max(s, *end));
    const bool forward = (*end > s) == (side > 0);
    return forward ? part : part.reversed();
  }

  /// Lets cloth into the piece: everything beyond a pleat moves on by twice its depth, and the border in between is that of the
  /// cloth under which, or over which, it comes to lie.
  Issues let_in() {
    Point2 shift = Point2::Zero();
    for (Knife& knife : knives_) {
      const auto hit = opposite(knife.origin, knife.inwards);
      TOILE_CHECK(hit, "the line of pleat {} does not leave the piece", knife.tag);
      knife.far_edge = hit->edge;
      knife.far_s = hit->s;
      if (piece_.fold && outline_[hit->edge].name == *piece_.fold) return {issue("pleat_on_fold", fmt::format("the line of pleat {} meets the fold of the cloth", knife.tag), "choose lines that do not, or lay the pleats without `spread`")};
      knife.shift = shift;
      shift += 2 * spec_.depth * knife.across;
    }
    // What is inside moves with the cloth around it.
    std::vector<Polyline> beyond;
    for (const Knife& knife : knives_) {
      std::vector<Curve> loop;
      for (std::size_t e = 0; e <= knife.far_edge; ++e) {
        const Curve& curve = outline_[e].curve;
        const double from = e == 0 ? knife.s : 0, to = e == knife.far_edge ? knife.far_s : curve.length();
        if (to - from > 1e-9) loop.push_back(curve.part(from, to));
      }
      loop.push_back(Curve({line_segment(loop.back().to(), loop.front().from())}));
      beyond.push_back(flatten(loop, 1e-6));
    }
    const auto shift_of = [&](const Point2& p) {
      Point2 sum = Point2::Zero();
      for (std::size_t k = 0; k < knives_.size(); ++k) {
        if (winds_around(beyond[k], p)) sum += 2 * spec_.depth * knives_[k].across;
      }
      return sum;
    };
    Issues issues;
    const auto moved_whole = [&](const std::string& name, const std::vector<Point2>& points) {
      const Point2 middle = points[points.size() / 2], by = shift_of(middle);
      for (const Point2& p : points) {
        // Points right on a pleat's line may be told to either side.
        if ((shift_of(p) - by).norm() < 1e-9 || (shift_of(p + weld_tolerance * (middle - p).normalized()) - by).norm() < 1e-9) continue;
        issues.push_back(issue("pleat_across", fmt::format("'{}.{}' lies across a pleat", piece_.name, name), "move the pleat or the line, or draw the piece with its pleats and leave `spread` out"));
        break;
      }
      return by;
    };
    const auto move_segments = [&](std::vector<Segment>& segments, const Point2& by) {
      if (by.isZero()) return;
      for (Segment& segment : segments) segment = pattern_from_metres_(shifted(by)(metres_(segment)));
    };
    const auto in_metres_line = [&](const std::vector<Segment>& segments) {
      std::vector<Segment> mapped;
      for (const Segment& segment : segments) mapped.push_back(metres_(segment));
      return flatten({Curve(std::move(mapped))}, 1e-5).points;
    };
    std::map<std::string, Point2> points;
    for (const auto& [name, p] : piece_.points) points[name] = metres_(p) + shift_of(metres_(p));
    for (Hole& hole : piece_.holes) {
      std::vector<Point2> all;
      for (const Edge& edge : hole.edges) {
        const auto line = in_metres_line(edge.segments);
        all.insert(all.end(), line.begin(), line.end());
      }
      const Point2 by = moved_whole(hole.name, all);
      for (Edge& edge : hole.edges) {
        move_segments(edge.segments, by);
        for (const std::string& end : {edge.from, edge.to}) points[end] = metres_(piece_.points.at(end)) + by;
      }
    }
    for (InternalLine& line : piece_.lines) move_segments(line.segments, moved_whole(line.name, in_metres_line(line.segments)));
    for (Mark& mark : piece_.marks) mark.at = pattern_from_metres_(metres_(mark.at) + shift_of(metres_(mark.at)));

    // The border, from the edge's start all the way round; what was let in before each arc length tells where notches go.
    struct Cut {
      double s;
      std::size_t knife;
      bool far;
    };
    Point2 by = Point2::Zero();
    std::vector<WorkEdge> outline;
    std::map<std::string, std::vector<std::pair<double, double>>> let_into;  // per edge: arc length, length let in there
    std::map<std::string, Point2> on_border;                                 // points inside edges
    for (std::size_t e = 0; e < outline_.size(); ++e) {
      const WorkEdge& edge = outline_[e];
      std::vector<Cut> cuts;
      for (std::size_t k = 0; k < knives_.size(); ++k) {
        if (e == 0) cuts.push_back({knives_[k].s, k, false});
        if (knives_[k].far_edge == e) cuts.push_back({knives_[k].far_s, k, true});
      }
      // Pleats at one place: in their order on the edge, in the opposite order on the far side.
      std::sort(cuts.begin(), cuts.end(), [](const Cut& a, const Cut& b) { return std::abs(a.s - b.s) > 1e-9 ? a.s < b.s : a.far ? a.knife > b.knife : a.knife < b.knife; });
      std::vector<Segment> segments;
      const auto lay = [&](const Curve& curve) {
        for (const Segment& segment : curve.segments()) segments.push_back(segment);
      };
      const auto own_points = [&](double from, double to, bool last) {
        for (const auto& [name, p] : piece_.points) {
          const auto nearest = edge.curve.nearest(metres_(p));
          if (nearest.distance < on_edge_tolerance && nearest.s > 1e-9 && nearest.s < edge.curve.length() - 1e-9 && nearest.s >= from && (last ? nearest.s <= to : nearest.s < to)) on_border[name] = metres_(p) + by;
        }
      };
      double s = 0;
      points[edge.from] = edge.curve.from() + by;
      for (const Cut& cut : cuts) {
        const Knife& knife = knives_[cut.knife];
        if (cut.s - s > 1e-9) lay(edge.curve.part(s, cut.s).mapped(shifted(by)));
        own_points(s, cut.s, false);
        s = std::max(s, cut.s);
        const auto strip = beside(knife, e, cut.s);
        if (!strip) {
          issues.push_back(issue("pleat_off_edge", fmt::format("beside pleat {} less than {:.1f} mm of {}.{} are left", knife.tag, spec_.depth * 1e3, piece_.name, edge.name), "move the pleat away from the corner, or make it less deep"));
          continue;
        }
        if (cut.far) by -= 2 * spec_.depth * knife.across;
        // Hidden cloth in the direction of x, in the frame of the cloth before the pleat.
        const Curve turned = strip->mapped(reflected(knife.origin + (knife.ahead ? 0 : spec_.depth) * knife.across, knife.across)).reversed();
        const Curve again = knife.ahead ? strip->mapped(shifted(2 * spec_.depth * knife.across)) : *strip;
        std::vector<Curve> strips = knife.ahead ? std::vector{turned, again} : std::vector{again, turned};
        if (cut.far) strips = {strips[1].reversed(), strips[0].reversed()};
        for (const Curve& hidden : strips) lay(hidden.mapped(shifted(by)));
        let_into[edge.name].emplace_back(cut.s, 2 * strip->length());
        if (!cut.far) by += 2 * spec_.depth * knife.across;
      }
      if (edge.curve.length() - s > 1e-9) lay(edge.curve.part(s, edge.curve.length()).mapped(shifted(by)));
      own_points(s, edge.curve.length(), true);
      points[edge.to] = edge.curve.to() + by;
      for (std::size_t k = 1; k < segments.size(); ++k) segments[k].from = segments[k - 1].to;
      outline.push_back({edge.name, edge.from, edge.to, Curve(std::move(segments))});
    }
    if (!issues.empty()) return issues;
    for (const auto& [name, p] : on_border) points[name] = p;
    for (auto& [name, p] : piece_.points) p = pattern_from_metres_(points.at(name));
    move_notches(let_into);
    outline_ = std::move(outline);
    store_outline();
    return {};
  }

  void move_notches(const std::map<std::string, std::vector<std::pair<double, double>>>& let_into) {
    const double scale = std::sqrt(std::abs(metres_.linear.determinant()));
    for (Notch& notch : piece_.notches) {
      const auto found = let_into.find(notch.edge);
      if (found == let_into.end() || notch.point) continue;
      const auto edge = std::find_if(outline_.begin(), outline_.end(), [&](const WorkEdge& e) { return e.name == notch.edge; });
      const double length = edge->curve.length();
      double s = notch.distance ? *notch.distance * scale + (*notch.distance < 0 ? length : 0) : *notch.fraction * length;
      double let_in = 0, total = 0;
      // Distances are given in the direction in which the edge is drawn.
      for (const auto& [at, more] : found->second) {
        total += more;
        if ((turned_ ? length - at : at) < s - weld_tolerance) let_in += more;
      }
      s += let_in;
      notch.fraction.reset();
      notch.distance = std::clamp(s, 0.0, length + total) / scale;
    }
  }

  void store_outline() {
    std::vector<WorkEdge> edges = outline_;
    std::rotate(edges.begin(), edges.end() - first_, edges.end());
    if (turned_) {
      std::reverse(edges.begin(), edges.end());
      for (WorkEdge& edge : edges) edge = {edge.name, edge.to, edge.from, edge.curve.reversed()};
    }
    for (std::size_t e = 0; e < edges.size(); ++e) {
      std::vector<Segment> segments;
      for (const Segment& segment : edges[e].curve.segments()) segments.push_back(pattern_from_metres_(segment));
      segments.front().from = piece_.points.at(edges[e].from);
      segments.back().to = piece_.points.at(edges[e].to);
      piece_.outline[e].segments = std::move(segments);
    }
  }

  /// The fold lines and the points at their ends on the edge.
  Issues draw() {
    Issues issues;
    std::set<std::string> taken;
    for (const Edge& edge : piece_.outline) taken.insert(edge.name);
    for (const Hole& hole : piece_.holes) {
      for (const Edge& edge : hole.edges) taken.insert(edge.name);
    }
    for (const InternalLine& line : piece_.lines) taken.insert(line.name);
    static constexpr std::array kinds{"knife", "knife", "box", "inverted"};
    std::vector<std::pair<Point2, Point2>> drawn;
    for (const Knife& knife : knives_) {
      struct Row {
        const char* role;
        double x, angle;
        std::optional<double> length;
      };
      // The visible fold is a ridge of the face side, the hidden one a valley.
      const double outer = knife.ahead ? 0 : 2 * spec_.depth, meet = 2 * spec_.depth - outer;
      std::vector<Row> rows{{"outer", outer, -spec_.angle, spec_.pressed}, {"inner", spec_.depth, spec_.angle, spec_.pressed}};
      // The two folds of an inverted pleat lie on one and the same line.
      const bool shared = spec_.direction == PleatDirection::inverted && !knife.ahead;
      if (spec_.length > 0 && !shared) rows.push_back({"meet", meet, 0, spec_.length});
      for (const Row& row : rows) {
        const std::string name = fmt::format("{}_{}_{}", spec_.name, knife.tag, row.role);
        if (!taken.insert(name).second || piece_.points.count(name)) {
          issues.push_back(issue("duplicate_name", fmt::format("the piece has a line or point '{}' already", name), "give the pleats another name"));
          continue;
        }
        const Point2 aim = knife.origin + knife.shift + row.x * knife.across;
        const auto s = nearest_crossing(outline_.front().curve, aim, knife.across, outline_.front().curve.nearest(aim).s);
        if (!s) {
          issues.push_back(issue("pleat_off_edge", fmt::format("the line {} does not meet {}", name, edge_text()), "move the pleats, or make them fewer or less deep"));
          continue;
        }
        const Point2 from = outline_.front().curve.point_at(*s);
        const auto hit = opposite(from, knife.inwards);
        TOILE_CHECK(hit, "the line {} does not leave the piece", name);
        Point2 to = outline_[hit->edge].curve.point_at(hit->s);
        if (row.length && *row.length < hit->distance - 1e-4) to = from + *row.length * knife.inwards;
        drawn.emplace_back(from, to);
        const Point2 a = pattern_from_metres_(from), b = pattern_from_metres_(to);
        piece_.lines.push_back({name, row.angle == 0 ? LineKind::stitch : LineKind::fold, {line_segment(a, b)}});
        piece_.points[name] = a;
        parts_.push_back({piece_.name, name, kinds[static_cast<std::size_t>(spec_.direction)], row.angle, index_});
      }
    }
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      for (std::size_t j = i + 1; j < drawn.size(); ++j) {
        const Point2 d = drawn[i].second - drawn[i].first, e = drawn[j].second - drawn[j].first, gap = drawn[j].first - drawn[i].first;
        const double det = cross(d, e);
        if (std::abs(det) < 1e-12) continue;
        const double t = cross(gap, e) / det, u = cross(gap, d) / det;
        if (t < 0 || t > 1 || u < 0 || u > 1) continue;
        issues.push_back(issue("pleats_cross", "the lines of two pleats cross inside the piece", "take `along: grain`, or press them only as far as they are apart"));
        return issues;
      }
    }
    return issues;
  }

  const PleatSpec& spec_;
  std::size_t index_;
  Similarity metres_, pattern_from_metres_;
  std::vector<WorkEdge> outline_;
  std::ptrdiff_t first_ = 0;
  bool turned_ = false;
  std::vector<Knife> knives_;
};

}  // namespace

Result<Pleated> add_pleats(const Pattern& pattern, const std::vector<PleatSpec>& pleats) {
  Issues issues = check(pattern);
  if (!issues.empty()) return issues;
  Pleated result{pattern, {}};
  std::vector<std::string> names;
  for (const Piece& piece : pattern.pieces) names.push_back(piece.name);
  std::set<std::string> used;
  for (std::size_t k = 0; k < pleats.size(); ++k) {
    const PleatSpec& spec = pleats[k];
    const auto complain = [&](const char* code, std::string what, std::string remedy) { issues.push_back({code, {.item = "pleats " + spec.name}, std::move(what), std::move(remedy), Category::check}); };
    if (!used.insert(spec.name).second) complain("duplicate_name", "two rows of pleats have this name", "rename one");
    const auto piece = std::find_if(result.pattern.pieces.begin(), result.pattern.pieces.end(), [&](const Piece& p) { return p.name == spec.piece; });
    if (piece == result.pattern.pieces.end()) {
      complain("unknown_piece", fmt::format("the pattern has no piece '{}'", spec.piece), suggestion(spec.piece, names));
      continue;
    }
    std::vector<std::string> edges;
    for (const Edge& edge : piece->outline) edges.push_back(edge.name);
    if (std::find(edges.begin(), edges.end(), spec.edge) == edges.end()) {
      complain("unknown_edge", fmt::format("the outline of '{}' has no edge '{}'", spec.piece, spec.edge), suggestion(spec.edge, edges));
      continue;
    }
    Pleater pleater(result.pattern, *piece, spec, k);
    if (const Issues trouble = pleater.run(); !trouble.empty()) {
      append(issues, trouble);
      continue;
    }
    *piece = std::move(pleater.piece_);
    result.parts.insert(result.parts.end(), pleater.parts_.begin(), pleater.parts_.end());
  }
  if (!issues.empty()) return issues;
  issues = check(result.pattern);
  if (!issues.empty()) return issues;
  return result;
}

}  // namespace toile::pattern
