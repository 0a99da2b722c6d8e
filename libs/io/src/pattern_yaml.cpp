#include "toile/io/pattern_yaml.h"

#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>

#include "toile/base/text.h"
#include "toile/base/units.h"
#include "toile/io/file.h"

namespace toile::io {
namespace {

using pattern::Point2;

constexpr std::array unit_names{"mm", "cm", "m", "inch"};
constexpr std::array line_kinds{"fold", "dart", "placement", "stitch", "cut", "other"};
constexpr std::array mark_kinds{"drill", "button", "buttonhole", "snap", "hook"};

class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  PatternReading read(std::string_view yaml) {
    try {
      const std::vector<YAML::Node> documents = YAML::LoadAll(std::string(yaml));
      if (documents.size() == 1) {
        read_root(documents.front());
      } else {
        issues_.push_back(Issue{"bad_yaml",
                                {.file = file_},
                                fmt::format("the file has {} YAML documents instead of one", documents.size()),
                                "write one mapping with units and pieces"});
      }
    } catch (const YAML::Exception& e) {
      const Place where{file_, e.mark.is_null() ? 0 : e.mark.line + 1, e.mark.is_null() ? 0 : e.mark.column + 1, ""};
      issues_.push_back(Issue{"bad_yaml", where, e.msg, "correct the YAML here"});
    }
    return {std::move(result_), std::move(issues_)};
  }

 private:
  Place place(const YAML::Node& node, const std::string& item) const {
    const YAML::Mark mark = node.Mark();
    return {file_, mark.is_null() ? 0 : mark.line + 1, mark.is_null() ? 0 : mark.column + 1, item};
  }
  void report(const char* code, const YAML::Node& node, const std::string& item, std::string what, std::string remedy) {
    issues_.push_back(Issue{code, place(node, item), std::move(what), std::move(remedy)});
  }
  void wrong_type(const YAML::Node& node, const std::string& item, const std::string& wanted) {
    const char* given = node.IsScalar()     ? "a single value"
                        : node.IsSequence() ? "a list"
                        : node.IsMap()      ? "a mapping"
                                            : "nothing";
    report("wrong_type", node, item, fmt::format("{} stands where {} is needed", given, wanted),
           fmt::format("write {}", wanted));
  }

  /// The values of a mapping by key, in the order of the file; doubled keys are reported.
  std::vector<std::pair<std::string, YAML::Node>> entries(const YAML::Node& node, const std::string& item,
                                                          const std::string& wanted) {
    std::vector<std::pair<std::string, YAML::Node>> result;
    if (!node.IsMap()) {
      wrong_type(node, item, wanted);
      return result;
    }
    std::set<std::string> seen;
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) {
        wrong_type(entry.first, item, "a name as key");
        continue;
      }
      const std::string& key = entry.first.Scalar();
      if (!seen.insert(key).second) {
        report("duplicate_key", entry.first, item, fmt::format("the key '{}' stands twice", key), "keep one of them");
        continue;
      }
      result.emplace_back(key, entry.second);
    }
    return result;
  }

  using Handlers = std::vector<std::pair<std::string, std::function<void(const YAML::Node&)>>>;
  /// Calls the handler of each key, in the order of the handlers; reports unknown and missing ones.
  void fields(const YAML::Node& node, const std::string& item, const std::string& wanted, const Handlers& handlers,
              const std::vector<std::string>& required) {
    const auto given = entries(node, item, wanted);
    if (!node.IsMap()) return;
    std::vector<std::string> known;
    for (const auto& [key, handler] : handlers) known.push_back(key);
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) continue;
      const std::string& key = entry.first.Scalar();
      if (std::find(known.begin(), known.end(), key) == known.end()) {
        report("unknown_key", entry.first, item, fmt::format("unknown key '{}'", key), suggestion(key, known));
      }
    }
    for (const std::string& key : required) {
      if (std::none_of(given.begin(), given.end(), [&](const auto& entry) { return entry.first == key; })) {
        report("missing_key", node, item, fmt::format("the key '{}' is missing", key), fmt::format("add '{}'", key));
      }
    }
    for (const auto& [key, handler] : handlers) {
      for (const auto& [name, value] : given) {
        if (name == key) handler(value);
      }
    }
  }

  std::optional<std::string> text(const YAML::Node& node, const std::string& item, const std::string& wanted) {
    if (node.IsScalar()) return node.Scalar();
    wrong_type(node, item, wanted);
    return std::nullopt;
  }
  std::optional<double> number(const YAML::Node& node, const std::string& item) {
    if (!node.IsScalar()) {
      wrong_type(node, item, "a number");
      return std::nullopt;
    }
    const auto value = parse_number(node.Scalar());
    if (!value) report("bad_number", node, item, fmt::format("'{}' is no number", node.Scalar()), "write a number");
    return value;
  }
  /// A length in pattern units; a unit of its own is converted.
  std::optional<double> length(const YAML::Node& node, const std::string& item) {
    if (!node.IsScalar()) {
      wrong_type(node, item, "a length");
      return std::nullopt;
    }
    if (const auto value = parse_number(node.Scalar())) return value;
    const auto metres = parse_quantity(node.Scalar(), "m");
    if (metres) return *metres / in_metres(result_.pattern.units);
    Issue issue = metres.issues().front();
    issue.place = place(node, item);
    issues_.push_back(issue);
    return std::nullopt;
  }
  std::optional<bool> flag(const YAML::Node& node, const std::string& item) {
    if (node.IsScalar() && (node.Scalar() == "true" || node.Scalar() == "false")) return node.Scalar() == "true";
    wrong_type(node, item, "true or false");
    return std::nullopt;
  }
  template <std::size_t N>
  std::optional<std::size_t> choice(const YAML::Node& node, const std::string& item,
                                    const std::array<const char*, N>& names) {
    if (!node.IsScalar()) {
      wrong_type(node, item, fmt::format("one of {}", fmt::join(names, ", ")));
      return std::nullopt;
    }
    for (std::size_t i = 0; i < N; ++i) {
      if (node.Scalar() == names[i]) return i;
    }
    const std::vector<std::string> known(names.begin(), names.end());
    report("bad_choice", node, item, fmt::format("'{}' is not known here", node.Scalar()),
           suggestion(node.Scalar(), known));
    return std::nullopt;
  }
  std::optional<Point2> coordinates(const YAML::Node& node, const std::string& item) {
    if (!node.IsSequence() || node.size() != 2) {
      wrong_type(node, item, "a position [x, y]");
      return std::nullopt;
    }
    const auto x = number(node[0], item), y = number(node[1], item);
    if (!x || !y) return std::nullopt;
    return Point2(*x, *y);
  }
  /// A position: the name of a point, or [x, y].
  std::optional<Point2> position(const YAML::Node& node, const std::string& item, const pattern::Piece& piece) {
    if (!node.IsScalar()) return coordinates(node, item);
    const auto it = piece.points.find(node.Scalar());
    if (it != piece.points.end()) return it->second;
    if (unreadable_points_.count(piece.name + "." + node.Scalar())) return std::nullopt;  // told where it stands
    std::vector<std::string> names;
    for (const auto& [name, p] : piece.points) names.push_back(name);
    report("unknown_point", node, item, fmt::format("there is no point '{}'", node.Scalar()),
           suggestion(node.Scalar(), names));
    return std::nullopt;
  }

  void read_root(const YAML::Node& root) {
    pattern::Pattern& p = result_.pattern;
    fields(root, "", "a mapping with units and pieces",
           {{"name", [&](const YAML::Node& n) { p.name = text(n, "name", "a name").value_or(""); }},
            {"origin", [&](const YAML::Node& n) { p.origin = text(n, "origin", "a text").value_or(""); }},
            {"units",
             [&](const YAML::Node& n) {
               p.units = static_cast<pattern::LengthUnit>(choice(n, "units", unit_names).value_or(0));
             }},
            {"y",
             [&](const YAML::Node& n) {
               p.y_down = choice(n, "y", std::array{"up", "down"}).value_or(0) == 1;
             }},
            {"pieces",
             [&](const YAML::Node& n) {
               for (const auto& [name, node] : entries(n, "pieces", "a mapping of pieces by name"))
                 read_piece(name, node);
             }}},
           {"units", "y", "pieces"});
  }

  void read_piece(const std::string& name, const YAML::Node& node) {
    pattern::Piece piece;
    piece.name = name;
    result_.places[name] = place(node, name);
    const auto part = [&](const std::string& what) { return name + "." + what; };
    const auto remember = [&](const std::string& item, const YAML::Node& n) {
      result_.places.try_emplace(item, place(n, item));
    };
    const auto read_lines = [&](const YAML::Node& n) {
      for (const auto& [line, value] : entries(n, part("lines"), "a mapping of lines by name")) {
        const std::string item = part(line);
        remember(item, value);
        pattern::InternalLine internal{.name = line};
        fields(value, item, "{kind: ..., path: [...]}",
               {{"kind",
                 [&](const YAML::Node& k) {
                   internal.kind = static_cast<pattern::LineKind>(choice(k, item, line_kinds).value_or(5));
                 }},
                {"path",
                 [&](const YAML::Node& k) { internal.segments = read_path(k, item, piece, PathEnds::any).segments; }}},
               {"path"});
        piece.lines.push_back(internal);
      }
    };
    const auto read_notches = [&](const YAML::Node& n) {
      for (const auto& [notch_name, value] : entries(n, part("notches"), "a mapping of notches by name")) {
        const std::string item = part(notch_name);
        remember(item, value);
        pattern::Notch notch{.name = notch_name};
        fields(value, item, "{edge: ..., point: ...}",
               {{"edge", [&](const YAML::Node& k) { notch.edge = text(k, item, "the name of an edge").value_or(""); }},
                {"point", [&](const YAML::Node& k) { notch.point = text(k, item, "the name of a point"); }},
                {"distance", [&](const YAML::Node& k) { notch.distance = length(k, item); }},
                {"fraction", [&](const YAML::Node& k) { notch.fraction = number(k, item); }}},
               {"edge"});
        piece.notches.push_back(notch);
      }
    };
    const auto read_marks = [&](const YAML::Node& n) {
      for (const auto& [mark_name, value] : entries(n, part("marks"), "a mapping of marks by name")) {
        const std::string item = part(mark_name);
        remember(item, value);
        pattern::Mark mark{.name = mark_name};
        fields(value, item, "{kind: ..., at: [x, y]}",
               {{"kind",
                 [&](const YAML::Node& k) {
                   mark.kind = static_cast<pattern::MarkKind>(choice(k, item, mark_kinds).value_or(0));
                 }},
                {"at", [&](const YAML::Node& k) { mark.at = position(k, item, piece).value_or(Point2::Zero()); }}},
               {"at"});
        piece.marks.push_back(mark);
      }
    };
    fields(
        node, name, "a mapping that describes the piece",
        {{"material", [&](const YAML::Node& n) { piece.material = text(n, part("material"), "a name").value_or(""); }},
         {"cut",
          [&](const YAML::Node& n) {
            const auto value = n.IsScalar() ? parse_integer(n.Scalar()) : std::nullopt;
            if (!value || *value < 1 || *value > 1000)
              return wrong_type(n, part("cut"), "a whole number from 1 to 1000");
            piece.copies = static_cast<int>(*value);
          }},
         {"identical", [&](const YAML::Node& n) { piece.identical = flag(n, part("identical")).value_or(false); }},
         {"allowance", [&](const YAML::Node& n) { piece.allowance = length(n, part("allowance")); }},
         {"points",
          [&](const YAML::Node& n) {
            for (const auto& [point, value] : entries(n, part("points"), "a mapping of positions by name")) {
              remember(part(point), value);
              const auto p = coordinates(value, part(point));
              if (p)
                piece.points[point] = *p;
              else
                unreadable_points_.insert(name + "." + point);
            }
          }},
         {"fold",
          [&](const YAML::Node& n) {
            remember(part("fold"), n);
            piece.fold = text(n, part("fold"), "the name of an edge");
          }},
         {"grain",
          [&](const YAML::Node& n) {
            remember(part("grain"), n);
            read_grain(n, part("grain"), piece);
          }},
         {"outline", [&](const YAML::Node& n) { piece.outline = read_edges(n, part("outline"), piece); }},
         {"holes",
          [&](const YAML::Node& n) {
            for (const auto& [hole, value] : entries(n, part("holes"), "a mapping of lists of edges by name")) {
              remember(part(hole), value);
              piece.holes.push_back({hole, read_edges(value, part(hole), piece)});
            }
          }},
         {"lines", read_lines},
         {"notches", read_notches},
         {"marks", read_marks}},
        {"outline"});
    result_.pattern.pieces.push_back(std::move(piece));
  }

  void read_grain(const YAML::Node& node, const std::string& item, pattern::Piece& piece) {
    if (node.IsScalar() && node.Scalar() == "fold") {
      if (!piece.fold)
        report("missing_key", node, item, "the grain follows the fold, but the piece has no fold",
               "name the edge on the fold, or give two points");
      return;
    }
    if (!node.IsSequence() || node.size() != 2) return wrong_type(node, item, "two positions [from, to], or fold");
    const auto from = position(node[0], item, piece), to = position(node[1], item, piece);
    if (from && to) piece.grain = pattern::Grain{*from, *to};
  }

  std::vector<pattern::Edge> read_edges(const YAML::Node& node, const std::string& loop, const pattern::Piece& piece) {
    std::vector<pattern::Edge> edges;
    if (!node.IsSequence()) {
      wrong_type(node, loop, "a list of edges {name: ..., path: [...]}");
      return edges;
    }
    for (const YAML::Node& entry : node) {
      pattern::Edge edge;
      std::string item = loop;
      fields(entry, loop, "an edge {name: ..., path: [...]}",
             {{"name",
               [&](const YAML::Node& n) {
                 edge.name = text(n, loop, "a name").value_or("");
                 item = piece.name + "." + edge.name;
               }},
              {"path",
               [&](const YAML::Node& n) {
                 Path path = read_path(n, item, piece, PathEnds::named);
                 edge.from = path.from;
                 edge.to = path.to;
                 edge.segments = std::move(path.segments);
               }},
              {"allowance", [&](const YAML::Node& n) { edge.allowance = length(n, item); }}},
             {"name", "path"});
      // A point may have the name of an edge; the place of the edge is the one that checks mean.
      result_.places[item] = place(entry, item);
      edges.push_back(std::move(edge));
    }
    return edges;
  }

  enum class PathEnds { named, any };
  struct Path {
    std::string from, to;
    std::vector<pattern::Segment> segments;
  };
  /// Positions with what lies between them: nothing is a line.
  Path read_path(const YAML::Node& node, const std::string& item, const pattern::Piece& piece, PathEnds ends) {
    Path path;
    if (!node.IsSequence() || node.size() < 2) {
      wrong_type(node, item, "a path [from, ..., to]");
      return path;
    }
    std::optional<Point2> last;
    std::optional<YAML::Node> between;
    bool known_start = false;  // a position stands before, be it good or not
    for (const YAML::Node& step : node) {
      if (step.IsMap()) {
        if (!known_start) report("bad_path", step, item, "the path begins with a curve", "begin it with a point");
        if (between)
          report("bad_path", step, item, "two curves follow each other without a point between",
                 "put the point where they meet between them");
        between.emplace(step);
        continue;
      }
      known_start = true;
      const auto p = position(step, item, piece);
      if (p && last) {
        if (const auto segment = read_segment(between, *last, *p, item, piece)) path.segments.push_back(*segment);
      }
      between.reset();
      last = p;
    }
    if (between) report("bad_path", *between, item, "the path ends with a curve", "end it with a point");
    const YAML::Node first = node[0], final = node[node.size() - 1];
    if (ends == PathEnds::named) {
      for (const YAML::Node& end : {first, final}) {
        if (!end.IsScalar() && !end.IsMap()) wrong_type(end, item, "the name of a point at the end of an edge");
      }
    }
    if (first.IsScalar()) path.from = first.Scalar();
    if (final.IsScalar()) path.to = final.Scalar();
    return path;
  }

  std::optional<pattern::Segment> read_segment(const std::optional<YAML::Node>& node, const Point2& from,
                                               const Point2& to, const std::string& item, const pattern::Piece& piece) {
    if (!node) return pattern::line_segment(from, to);
    std::optional<pattern::Segment> segment;
    fields(*node, item, "{curve: [...]} or {arc: {...}}",
           {{"curve",
             [&](const YAML::Node& n) {
               if (!n.IsSequence() || n.size() < 1 || n.size() > 2)
                 return wrong_type(n, item, "one or two control points [[x, y], [x, y]]");
               const auto a = position(n[0], item, piece);
               const auto b = n.size() == 2 ? position(n[1], item, piece) : a;
               if (!a || !b) return;
               segment =
                   n.size() == 2 ? pattern::cubic_segment(from, *a, *b, to) : pattern::quadratic_segment(from, *a, to);
             }},
            {"arc", [&](const YAML::Node& n) { segment = read_arc(n, from, to, item, piece); }}},
           {});
    if (node->size() != 1) report("bad_path", *node, item, "a curve is one of curve and arc", "keep one of them");
    return segment;
  }

  std::optional<pattern::Segment> read_arc(const YAML::Node& node, const Point2& from, const Point2& to,
                                           const std::string& item, const pattern::Piece& piece) {
    std::optional<Point2> through;
    std::optional<double> bulge, radius;
    bool left = true, large = false;
    const std::size_t before = issues_.size();
    fields(node, item, "{through: [x, y]}, {radius: r, turn: left} or {bulge: b}",
           {{"through", [&](const YAML::Node& n) { through = position(n, item, piece); }},
            {"radius", [&](const YAML::Node& n) { radius = length(n, item); }},
            {"turn",
             [&](const YAML::Node& n) {
               left = choice(n, item, std::array{"left", "right"}).value_or(0) == 0;
             }},
            {"large", [&](const YAML::Node& n) { large = flag(n, item).value_or(false); }},
            {"bulge", [&](const YAML::Node& n) { bulge = number(n, item); }}},
           {});
    if (issues_.size() != before) return std::nullopt;
    if (through.has_value() + bulge.has_value() + radius.has_value() != 1 ||
        radius.has_value() != node["turn"].IsDefined() || (node["large"].IsDefined() && !radius)) {
      report("bad_arc", node, item, "an arc is given by one of through, radius (with turn, perhaps large) and bulge",
             "keep one of them");
      return std::nullopt;
    }
    if (bulge) return pattern::arc_segment(from, to, *bulge);
    if (through) {
      const auto arc = pattern::arc_through(from, *through, to);
      if (arc) return *arc;
      Issue issue = arc.issues().front();
      issue.place = place(node, item);
      issues_.push_back(issue);
      return std::nullopt;
    }
    const double half = (to - from).norm() / 2;
    if (!(*radius >= half) || !(half > 0)) {
      report("bad_arc", node, item,
             fmt::format("no circle of radius {} passes through both ends, which are {} apart", *radius, 2 * half),
             fmt::format("give a radius of {} or more", half));
      return std::nullopt;
    }
    const double quarter = std::asin(half / *radius) / 2;  // a fourth of the smaller turn
    const double size = large ? 1 / std::tan(quarter) : std::tan(quarter);
    // Left as seen on the drawing: with y down, x turns towards y by going right.
    return pattern::arc_segment(from, to, left != result_.pattern.y_down ? size : -size);
  }

  std::string file_;
  PatternFile result_;
  Issues issues_;
  std::set<std::string> unreadable_points_;
};

// -----------------------------------------------------------------------------------------------------------------

/// A text as a YAML scalar: plain where that is safe, else in double quotes.
std::string scalar(const std::string& text) {
  static const std::string marks = "_-./ ()@";
  const auto plain_char = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || marks.find(c) != std::string::npos;
  };
  const bool plain = !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) && text.back() != ' ' &&
                     std::all_of(text.begin(), text.end(), plain_char);
  static const std::set<std::string> reserved{"true", "false", "yes", "no", "on", "off", "null", "y", "n"};
  std::string lower = text;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  if (plain && !reserved.count(lower)) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '\n')
      quoted += "\\n";
    else if (code < 0x20 || code == 0x7f)
      quoted += fmt::format("\\x{:02x}", code);
    else
      quoted += c;
  }
  return quoted + "\"";
}

std::string xy(const Point2& p) {
  return fmt::format("[{}, {}]", format_number(p.x()), format_number(p.y()));
}

/// True also for the sign of zero, which a comparison would not see.
bool same(const Point2& a, const Point2& b) {
  return a == b && std::signbit(a.x()) == std::signbit(b.x()) && std::signbit(a.y()) == std::signbit(b.y());
}

class Writer {
 public:
  std::string write(const pattern::Pattern& p) {
    if (!p.name.empty()) line(0, "name: " + scalar(p.name));
    if (!p.origin.empty()) line(0, "origin: " + scalar(p.origin));
    line(0, std::string("units: ") + unit_names[static_cast<std::size_t>(p.units)]);
    line(0, std::string("y: ") + (p.y_down ? "down" : "up"));
    line(0, p.pieces.empty() ? "pieces: {}" : "pieces:");
    for (const pattern::Piece& piece : p.pieces) write_piece(piece);
    return text_;
  }

 private:
  void line(int depth, const std::string& text) {
    text_ += std::string(static_cast<std::size_t>(2 * depth), ' ') + text + "\n";
  }

  void write_piece(const pattern::Piece& piece) {
    line(1, scalar(piece.name) + ":");
    if (!piece.material.empty()) line(2, "material: " + scalar(piece.material));
    line(2, fmt::format("cut: {}", piece.copies));
    if (piece.identical) line(2, "identical: true");
    if (piece.fold) line(2, "fold: " + scalar(*piece.fold));
    if (piece.grain)
      line(2, fmt::format("grain: [{}, {}]", point(piece, piece.grain->from), point(piece, piece.grain->to)));
    else if (piece.fold)
      line(2, "grain: fold");
    if (piece.allowance) line(2, "allowance: " + format_number(*piece.allowance));
    if (!piece.points.empty()) line(2, "points:");
    for (const auto& [name, p] : piece.points) line(3, scalar(name) + ": " + xy(p));
    line(2, piece.outline.empty() ? "outline: []" : "outline:");
    for (const pattern::Edge& edge : piece.outline) line(3, "- " + edge_text(piece, edge));
    if (!piece.holes.empty()) line(2, "holes:");
    for (const pattern::Hole& hole : piece.holes) {
      line(3, scalar(hole.name) + (hole.edges.empty() ? ": []" : ":"));
      for (const pattern::Edge& edge : hole.edges) line(4, "- " + edge_text(piece, edge));
    }
    if (!piece.lines.empty()) line(2, "lines:");
    for (const pattern::InternalLine& internal : piece.lines) {
      line(3, fmt::format("{}: {{kind: {}, path: {}}}", scalar(internal.name),
                          line_kinds[static_cast<std::size_t>(internal.kind)],
                          path_text(piece, internal.segments, "", "")));
    }
    if (!piece.notches.empty()) line(2, "notches:");
    for (const pattern::Notch& notch : piece.notches) {
      std::string text = fmt::format("{}: {{edge: {}", scalar(notch.name), scalar(notch.edge));
      if (notch.point) text += ", point: " + scalar(*notch.point);
      if (notch.distance) text += ", distance: " + format_number(*notch.distance);
      if (notch.fraction) text += ", fraction: " + format_number(*notch.fraction);
      line(3, text + "}");
    }
    if (!piece.marks.empty()) line(2, "marks:");
    for (const pattern::Mark& mark : piece.marks) {
      line(3, fmt::format("{}: {{kind: {}, at: {}}}", scalar(mark.name),
                          mark_kinds[static_cast<std::size_t>(mark.kind)], xy(mark.at)));
    }
  }

  std::string point(const pattern::Piece& piece, const Point2& p) const {
    for (const auto& [name, at] : piece.points) {
      if (same(at, p)) return scalar(name);
    }
    return xy(p);
  }

  std::string edge_text(const pattern::Piece& piece, const pattern::Edge& edge) const {
    std::string text =
        fmt::format("{{name: {}, path: {}", scalar(edge.name), path_text(piece, edge.segments, edge.from, edge.to));
    if (edge.allowance) text += ", allowance: " + format_number(*edge.allowance);
    return text + "}";
  }

  std::string path_text(const pattern::Piece& piece, const std::vector<pattern::Segment>& segments,
                        const std::string& from, const std::string& to) const {
    if (segments.empty()) return "[]";
    std::string text = "[" + (from.empty() ? point(piece, segments.front().from) : scalar(from));
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const pattern::Segment& s = segments[i];
      switch (s.kind) {
        case pattern::Segment::Kind::line:
          break;
        case pattern::Segment::Kind::quadratic:
          text += fmt::format(", {{curve: [{}]}}", xy(s.control_1));
          break;
        case pattern::Segment::Kind::cubic:
          text += fmt::format(", {{curve: [{}, {}]}}", xy(s.control_1), xy(s.control_2));
          break;
        case pattern::Segment::Kind::arc:
          text += fmt::format(", {{arc: {{bulge: {}}}}}", format_number(s.bulge));
          break;
      }
      text += ", " + (i + 1 == segments.size() && !to.empty() ? scalar(to) : point(piece, s.to));
    }
    return text + "]";
  }

  std::string text_;
};

}  // namespace

namespace {

Issues placed(Issues issues, const PatternFile& file) {
  for (Issue& issue : issues) {
    const std::string item = issue.place.item;
    auto it = file.places.find(item);
    // A part without a place of its own (a name that stands nowhere) is told at its piece.
    if (it == file.places.end()) it = file.places.find(item.substr(0, item.find('.')));
    if (it == file.places.end()) continue;
    issue.place = it->second;
    issue.place.item = item;
  }
  return issues;
}

}  // namespace

PatternReading read_pattern_form(std::string_view yaml, const std::string& file) {
  return Reader(file).read(yaml);
}

Result<PatternFile> parse_pattern_file(std::string_view yaml, const std::string& file) {
  PatternReading reading = read_pattern_form(yaml, file);
  if (!reading.issues.empty()) return std::move(reading.issues);
  return std::move(reading.file);
}

Issues check(const PatternFile& file) {
  return placed(pattern::check(file.pattern), file);
}

Issues advice(const PatternFile& file) {
  return placed(pattern::advice(file.pattern), file);
}

Result<pattern::Pattern> parse_pattern(std::string_view yaml, const std::string& file) {
  TOILE_TRY(PatternFile parsed, parse_pattern_file(yaml, file));
  const Issues issues = check(parsed);
  if (!issues.empty()) return issues;
  return std::move(parsed.pattern);
}

Result<pattern::Pattern> read_pattern(const std::string& path) {
  TOILE_TRY(const std::string bytes, read_file(path));
  return parse_pattern(bytes, path);
}

std::string format_pattern(const pattern::Pattern& pattern) {
  return Writer().write(pattern);
}

}  // namespace toile::io
