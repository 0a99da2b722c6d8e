// Pattern pieces as a pattern maker draws them, their checks, and the panels that are cut from them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "toile/pattern/curve.h"

namespace toile::pattern {

enum class LengthUnit { mm, cm, m, inch };
/// Metres in one unit.
double in_metres(LengthUnit unit);

/// Part of a border between two named points. It may pass through further named points.
struct Edge {
  std::string name;  ///< unique in its piece (holes and internal lines included)
  std::string from, to;
  std::vector<Segment> segments;    ///< from the first point to the second
  std::optional<double> allowance;  ///< seam allowance [pattern units]; without it the piece's (of holes: none)
  bool operator==(const Edge&) const = default;
};

/// A closed loop cut out of a piece, e.g. a fish-eye dart.
struct Hole {
  std::string name;
  std::vector<Edge> edges;
  bool operator==(const Hole&) const = default;
};

enum class LineKind { fold, dart, placement, stitch, cut, other };

/// A line on the cloth, open or closed.
struct InternalLine {
  std::string name;  ///< unique in its piece (edges included)
  LineKind kind = LineKind::other;
  std::vector<Segment> segments;
  bool operator==(const InternalLine&) const = default;
};

/// A notch on an edge, given in exactly one of three ways.
struct Notch {
  std::string name;  ///< unique among the piece's notches
  std::string edge;
  std::optional<std::string> point;  ///< a named point on the edge
  std::optional<double> distance;    ///< from the edge's first point [pattern units]; negative: from its last
  std::optional<double> fraction;    ///< of the edge's length, 0..1
  bool operator==(const Notch&) const = default;
};

enum class MarkKind { drill, button, buttonhole, snap, hook };

/// A point marked inside the piece.
struct Mark {
  std::string name;  ///< unique among the piece's marks
  MarkKind kind = MarkKind::drill;
  Point2 at = Point2::Zero();
  bool operator==(const Mark&) const = default;
};

/// The warp runs from `from` to `to`.
struct Grain {
  Point2 from = Point2::Zero(), to = Point2::Zero();
  bool operator==(const Grain&) const = default;
};

struct Piece {
  std::string name;
  std::string material;  ///< what it is cut from ("fabric", "lining", ...); free text, may be empty
  std::map<std::string, Point2> points;
  std::vector<Edge> outline;  ///< closed, either way round
  std::vector<Hole> holes;
  std::vector<InternalLine> lines;
  std::vector<Notch> notches;
  std::vector<Mark> marks;
  std::optional<Grain> grain;       ///< without it the fold edge is the grain line
  std::optional<std::string> fold;  ///< edge that lies on the fold of the cloth
  int copies = 1;                   ///< how many are cut
  bool identical = false;           ///< all copies alike; otherwise every second one is mirrored
  std::optional<double> allowance;  ///< seam allowance [pattern units]
  bool operator==(const Piece&) const = default;
};

struct Pattern {
  std::string name;
  std::string origin;  ///< where it comes from, its licence; free text
  LengthUnit units = LengthUnit::mm;
  bool y_down = false;  ///< coordinates have y towards the lower edge of the drawing
  std::vector<Piece> pieces;
  bool operator==(const Pattern&) const = default;
};

/// Everything that is wrong with a pattern, at once. Issue places name `piece.edge`; positions are in pattern units.
///   no_pieces, empty_outline, duplicate_name, bad_name, unknown_point, open_outline, edge_off_point, zero_length_edge,
///   zero_length_line, broken_edge, self_crossing, hole_outside, line_outside, dart_outside, mark_outside, unknown_edge, bad_notch,
///   notch_off_border, fold_not_straight, piece_across_fold, grain_missing, grain_zero, bad_copies, no_area
Issues check(const Pattern& pattern);

/// What is not wrong but probably not meant either, in pieces that check() has nothing against:
///   dart_legs_differ   the legs of a dart (in the outline, as a hole, as lines) differ by more than 1 mm and 0.5 %
///   line_along_edge    an internal line lies on the border or on another one: it cannot become an edge of the mesh
///   line_short_of_edge an internal line ends between 0.1 and 1 mm before the border: it will not end on it
///   short_edge         an edge is shorter than 1 mm
///   same_piece         two pieces have the same outline
Issues advice(const Pattern& pattern);

/// Where to split an edge: at a named point of the piece, at a position, or at a distance from the edge's first point
/// (negative: before its last); all in pattern units.
struct SplitAt {
  std::string point;  ///< name of the point there; created if `position` or `distance` is given
  std::optional<Point2> position;
  std::optional<double> distance;
};

/// Distance from an edge within which a point counts as lying on it [m].
inline constexpr double on_edge_tolerance = 1e-4;

/// Cuts one edge of the outline or of a hole into two, named `first` and `second`, in the edge's direction. The point
/// of the split is moved onto the curve. Notches follow their half.
/// tolerance  largest distance of the point from the edge [m]
/// error      Issue "unknown_edge", "unknown_point", "point_off_edge", "split_at_end", "split_fold", "duplicate_name"
Result<Piece> split_edge(const Piece& piece, LengthUnit units, const std::string& edge, const SplitAt& at,
                         const std::string& first, const std::string& second, double tolerance = on_edge_tolerance);

// ---------------------------------------------------------------------------------------------------------------
// What lies on the cutting table. All lengths in metres from here on.

struct PanelEdge {
  std::string name;
  std::string from, to;  ///< names of its end points
  Curve curve;
  double allowance = 0;  ///< seam allowance outside it
};

struct PanelHole {
  std::string name;
  std::vector<PanelEdge> edges;  ///< clockwise
};

struct PanelLine {
  std::string name;
  LineKind kind = LineKind::other;
  Curve curve;
  bool reflected = false;  ///< of a mirrored half or copy: what was on the left of the drawn line is on the right here
  /// Runs back into its own start.
  bool closed() const { return (curve.to() - curve.from()).norm() <= 1e-4; }
};

struct PanelPoint {
  enum class Where { border, inside, outside };
  std::string name;
  Point2 at = Point2::Zero();
  Where where = Where::inside;  ///< border: within 1e-6 m of an edge; outside: a drafting point off the cloth
  std::string edge;             ///< on the border: the edge it lies on (at a corner the one that starts there)
  double s = 0;                 ///< on the border: along that edge
};

struct PanelNotch {
  std::string name;
  std::string edge;
  double s = 0;  ///< along the edge as it stands in the panel
  Point2 at = Point2::Zero();
};

struct PanelMark {
  std::string name;
  MarkKind kind = MarkKind::drill;
  Point2 at = Point2::Zero();
};

/// One physical panel in panel coordinates (u, v): v along the grain, face side seen with u right and v up.
struct CutPanel {
  std::string name;  ///< `sleeve`, `sleeve_m`; further pairs `sleeve_2`, `sleeve_2_m`
  std::string piece;
  std::string material;
  bool mirrored = false;
  std::vector<PanelEdge> outline;  ///< closed, counter-clockwise; each edge starts exactly where the one before ends
  std::vector<PanelHole> holes;
  std::vector<PanelLine> lines;
  std::vector<PanelPoint> points;  ///< named points, by name
  std::vector<PanelNotch> notches;
  std::vector<PanelMark> marks;
  /// The line on which the panel was unfolded, from one border point to the other; the panel is symmetric about it.
  std::optional<std::pair<Point2, Point2>> fold;
  double area = 0;       ///< inside the outline without the holes, exact on the curves [m2]
  double perimeter = 0;  ///< of the outline [m]
  /// Of the seam allowances outside outline and holes [m2]: along every edge its length by its allowance, more on convex
  /// curves and less on concave ones. Corners are mitred: the kite between the two squared-off ends is added where the
  /// border turns outwards (by more than 120 degrees: as by 120) and taken off, as counted twice, where it turns
  /// inwards. Where the allowance changes so much that the offset lines do not meet, the wider one ends square.
  double allowance_area = 0;
};

/// Name of the copy-th panel cut from a piece (from 0): `sleeve`, `sleeve_m`, `sleeve_2`, ...
std::string panel_name(const Piece& piece, int copy);

/// The panels of a pattern, in the order of its pieces and copies. A piece on the fold becomes one panel: the fold edge
/// vanishes, everything of the other half has the suffix `_m`, what lies on the fold stays single; its copies are all
/// alike. A mirrored copy keeps its edge names. Edges of mirrored halves and copies run the other way, as do those of
/// an outline drawn clockwise. v runs from `grain.from` to `grain.to`, or up the drawing where the fold is the grain.
/// error  all issues of check()
Result<std::vector<CutPanel>> cut_panels(const Pattern& pattern);

/// The panel with a hole wherever the named internal lines close: a closed line, or several whose ends meet (within
/// on_edge_tolerance). What lies inside falls out: marks, too. The edges of a hole are called like their lines; a closed
/// line that turns by more than 60 degrees at n > 1 corners gives n edges `line_1`, ..., `line_n`, in its direction from
/// its first corner on. Lines that do not close stay lines. Names that are not there are ignored.
/// error  Issue "duplicate_name" where an edge of that name exists
Result<CutPanel> cut_out(const CutPanel& panel, const std::vector<std::string>& lines);

/// The edge of that name in outline or holes; null if there is none.
const PanelEdge* find_edge(const CutPanel& panel, std::string_view name);
const CutPanel* find_panel(const std::vector<CutPanel>& panels, std::string_view name);

}  // namespace toile::pattern
