// A draft of another program, as the importers of all formats hand it on. Private to the library.
#pragma once

#include <array>
#include <nlohmann/json.hpp>

#include "toile/io/pattern_import.h"

namespace toile::io {

using nlohmann::ordered_json;
using pattern::Point2;
using pattern::Segment;

/// Lengths in mm.
struct DraftPath {
  std::vector<std::vector<Segment>> strokes;  ///< one for each move
};

struct DraftPart {
  std::string name;
  std::vector<std::pair<std::string, Point2>> points;  ///< in the draft's order
  std::vector<std::pair<std::string, DraftPath>> paths;
  std::vector<std::string> drawn;  ///< names of paths that are not hidden
  std::vector<Point2> notches;
  std::vector<std::pair<std::string, Point2>> buttons;  ///< kind, position
  std::optional<std::pair<Point2, Point2>> grain, fold;
  struct Cut {
    std::string material;
    int copies = 1;
    bool identical = false, on_fold = false;
  };
  std::vector<Cut> cuts;
  bool grain_is_fold = false;
  std::map<std::string, std::string> edges;  ///< name -> run, where the draft itself names them

  const Point2* find(const std::string& point) const {
    for (const auto& [name, p] : points) {
      if (name == point) return &p;
    }
    return nullptr;
  }
  const DraftPath* path(const std::string& id) const {
    for (const auto& [name, p] : paths) {
      if (name == id) return &p;
    }
    return nullptr;
  }
  std::vector<std::string> point_names() const {
    std::vector<std::string> names;
    for (const auto& [name, p] : points) names.push_back(name);
    return names;
  }
  std::vector<std::string> path_names() const {
    std::vector<std::string> names;
    for (const auto& [name, p] : paths) names.push_back(name);
    return names;
  }
};

struct Draft {
  std::string origin;  ///< program, design and version
  std::string design;
  bool y_down = true;
  std::vector<DraftPart> parts;
  /// Two segments that are sewn together, each by its part and end points.
  struct Stitch {
    std::array<std::string, 2> part;
    std::array<std::pair<std::string, std::string>, 2> ends;
    bool same_direction = false;  ///< both run the same way round; usual seams run against each other
  };
  std::vector<Stitch> stitches;
};

/// A draft of another shape than expected; the place in words.
struct Malformed : std::runtime_error {
  using std::runtime_error::runtime_error;
};
inline void need(bool condition, const std::string& where, const std::string& wanted) {
  if (!condition) throw Malformed(fmt::format("{}: {} is needed", where, wanted));
}

Draft read_freesewing(const ordered_json& root);
Draft read_garmentcode(const ordered_json& root, Issues& notes);

/// The pieces that the spec asks for; the result passes pattern::check.
Result<ImportedPattern> import_draft(const Draft& draft, const std::string& file, const ImportParams& params);

}  // namespace toile::io
