// Patterns from other programs (docs/pattern.md, "Import").
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "toile/base/fields.h"
#include "toile/pattern/pattern.h"

namespace toile::io {

/// A cut of an edge at a distance that no drafted point marks.
struct ImportSplit {
  std::string edge, point;
  double distance = 0;  ///< [m]
  std::string first, second;
  static void describe(auto& f) {
    f(&ImportSplit::edge, {.key = "edge", .doc = "edge to cut in two", .required = true});
    f(&ImportSplit::distance, {.key = "distance",
                               .doc = "from the edge's first point; negative: before its last",
                               .unit = "m",
                               .min = -100,
                               .max = 100,
                               .required = true});
    f(&ImportSplit::point, {.key = "point", .doc = "name of the point made there", .required = true});
    f(&ImportSplit::first, {.key = "first", .doc = "name of the first part", .required = true});
    f(&ImportSplit::second, {.key = "second", .doc = "name of the second part", .required = true});
  }
};

/// A point that the draft lacks, made of its points.
struct ImportPoint {
  std::string from, to;
  std::optional<double> distance, fraction;
  std::optional<std::array<double, 2>> by;
  static void describe(auto& f) {
    f(&ImportPoint::from, {.key = "from", .doc = "point of the draft, or one made here", .required = true});
    f(&ImportPoint::to, {.key = "to", .doc = "towards this point"});
    f(&ImportPoint::distance, {.key = "distance", .doc = "so far from the first point", .unit = "m", .min = -100, .max = 100});
    f(&ImportPoint::fraction,
      {.key = "fraction", .doc = "or this part of the way", .unit = "1", .min = -100, .max = 100});
    f(&ImportPoint::by, {.key = "by", .doc = "or moved so far to the right and up the page", .unit = "m"});
    f.check([](const ImportPoint& point, Issues& issues) {
      const bool towards = !point.to.empty() && point.distance.has_value() != point.fraction.has_value() && !point.by;
      const bool moved = point.to.empty() && !point.distance && !point.fraction && point.by;
      if (!towards && !moved)
        issues.push_back(Issue{"bad_point", {.item = "from"}, "it is not clear where the point is",
                               "give `to` with a distance or a fraction, or `by` alone"});
    });
  }
};

struct ImportHole {
  std::string path;
  std::map<std::string, std::string> edges;
  static void describe(auto& f) {
    f(&ImportHole::path, {.key = "path", .doc = "closed path of the draft that is cut out", .required = true});
    f(&ImportHole::edges, {.key = "edges", .doc = "edges of the hole: name -> run of points"});
  }
};

struct ImportLine {
  std::string path, run;
  pattern::LineKind kind = pattern::LineKind::other;
  static void describe(auto& f) {
    f(&ImportLine::path, {.key = "path", .doc = "path of the draft"});
    f(&ImportLine::run, {.key = "run", .doc = "or lines through points: a>b>c; one or two points in brackets between two others are the "
                                    "controls of a curve: a>(c)>b"});
    f(&ImportLine::kind, {.key = "kind", .doc = "what the line is"});
    f.check([](const ImportLine& line, Issues& issues) {
      if (line.path.empty() == line.run.empty())
        issues.push_back(Issue{"bad_line", {.item = "path"}, "a line is given by a path or a run", "give one of them"});
    });
  }
};

struct ImportNotch {
  std::string edge;
  std::optional<std::string> point;
  std::optional<double> distance, fraction;
  static void describe(auto& f) {
    f(&ImportNotch::edge, {.key = "edge", .doc = "edge that has the notch", .required = true});
    f(&ImportNotch::point, {.key = "point", .doc = "drafted point on the edge"});
    f(&ImportNotch::distance,
      {.key = "distance", .doc = "or from the edge's first point; negative: before its last", .unit = "m"});
    f(&ImportNotch::fraction,
      {.key = "fraction", .doc = "or a fraction of the edge's length", .unit = "1", .min = 0, .max = 1});
  }
};

/// One piece: which part of the draft it is, and what its edges are called.
struct ImportPiece {
  std::string name, part;
  std::string path;
  std::string material;
  std::optional<int> cut;
  std::optional<bool> identical;
  std::string fold, grain;
  std::optional<double> allowance;
  std::map<std::string, double> allowances;
  std::map<std::string, ImportPoint> made;
  std::map<std::string, std::string> edges;
  std::vector<std::string> shortcuts;
  std::vector<ImportSplit> splits;
  std::map<std::string, ImportHole> holes;
  std::map<std::string, ImportLine> lines;
  std::map<std::string, ImportNotch> notches;
  std::vector<std::string> points;
  std::map<std::string, std::string> rename;
  static void describe(auto& f) {
    f(&ImportPiece::name, {.key = "name", .doc = "name of the piece", .required = true});
    f(&ImportPiece::part, {.key = "part", .doc = "part of the draft", .required = true});
    f(&ImportPiece::path,
      {.key = "path", .doc = "path that is the seam line, or one drawn through points: a>b>(c)>(d)>a; without it `seam`, else the only one drawn"});
    f(&ImportPiece::material,
      {.key = "material", .doc = "which material of the cut list it is cut from, or another one together with `cut`; without it the first"});
    f(&ImportPiece::cut,
      {.key = "cut", .doc = "how many are cut; without it as the cut list says", .min = 1, .max = 1000});
    f(&ImportPiece::identical, {.key = "identical", .doc = "all copies alike instead of mirrored pairs"});
    f(&ImportPiece::fold, {.key = "fold", .doc = "edge on the fold, or none; without it as the draft says"});
    f(&ImportPiece::grain, {.key = "grain", .doc = "x, y (up), fold, or two points a>b; without it as the draft says"});
    f(&ImportPiece::allowance,
      {.key = "allowance", .doc = "seam allowance all round", .unit = "m", .min = 0, .max = 1});
    f(&ImportPiece::allowances,
      {.key = "allowances", .doc = "of single edges, by name", .unit = "m", .min = 0, .max = 1});
    f(&ImportPiece::made, {.key = "made", .doc = "points that the draft lacks, by name"});
    f(&ImportPiece::edges,
      {.key = "edges", .doc = "edges of the outline: name -> run of points a>b>c; others are named by their ends"});
    f(&ImportPiece::shortcuts,
      {.key = "shortcuts",
       .doc = "runs a>b>c of straight lines that replace the outline from a to c, in its direction"});
    f(&ImportPiece::splits, {.key = "splits", .doc = "cuts of edges where no point is"});
    f(&ImportPiece::holes, {.key = "holes", .doc = "closed paths cut out, by name"});
    f(&ImportPiece::lines, {.key = "lines", .doc = "internal lines, by name"});
    f(&ImportPiece::notches, {.key = "notches", .doc = "further notches, by name"});
    f(&ImportPiece::points, {.key = "points", .doc = "further drafted points to keep"});
    f(&ImportPiece::rename, {.key = "rename", .doc = "drafted point -> its name in the pattern"});
  }
};

struct ImportParams {
  std::string name, origin, seams;
  double tolerance = 1e-4;
  std::vector<ImportPiece> pieces;
  static void describe(auto& f) {
    f(&ImportParams::name, {.key = "name", .doc = "name of the pattern; without it the design's"});
    f(&ImportParams::origin,
      {.key = "origin", .doc = "where the pattern comes from and its licence; without it the program and design"});
    f(&ImportParams::seams,
      {.key = "seams", .doc = "file that gets the draft's stitches as a seam spec (GarmentCode)"});
    f(&ImportParams::tolerance, {.key = "tolerance",
                                 .doc = "distance within which a drafted point lies on a line",
                                 .unit = "m",
                                 .min = 1e-7,
                                 .max = 0.01});
    f(&ImportParams::pieces, {.key = "pieces",
                              .doc = "pieces to take; without any, all parts with edges named by their ends (a missing "
                                     "grain is taken as up the page)"});
  }
};

struct ImportedPattern {
  pattern::Pattern pattern;
  Issues notes;       ///< things left out or assumed, for people to know
  std::string seams;  ///< the draft's stitches as a seam spec (YAML); empty if it has none
};

/// A FreeSewing draft (samples/patterns/freesewing/draft.mjs writes it) or a GarmentCode specification, as JSON; which
/// of them is seen from the file. The result passes pattern::check. error  Issue "bad_json", "bad_draft",
/// "unknown_part", "unknown_path", "unknown_point", "unknown_material", "bad_run",
///        "run_off_outline", "run_ambiguous", "edges_overlap", "no_fold_edge", "grain_missing", those of split_edge and
///        of pattern::check
Result<ImportedPattern> import_pattern(std::string_view json, const std::string& file, const ImportParams& params);

}  // namespace toile::io

template <>
struct toile::Choices<toile::pattern::LineKind> {
  static constexpr std::array names{std::pair{"fold", toile::pattern::LineKind::fold},
                                    std::pair{"dart", toile::pattern::LineKind::dart},
                                    std::pair{"placement", toile::pattern::LineKind::placement},
                                    std::pair{"stitch", toile::pattern::LineKind::stitch},
                                    std::pair{"cut", toile::pattern::LineKind::cut},
                                    std::pair{"other", toile::pattern::LineKind::other}};
};
