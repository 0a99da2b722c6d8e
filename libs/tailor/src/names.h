// Looking up what a spec names. Private to the library.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/tailor/fasten.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace toile::tailor {

/// `*` stands for any letters, none included.
bool matches(std::string_view pattern, std::string_view name);

struct Reference {
  bool reversed = false;
  std::string panel, item;
};
/// "panel.item" or "-panel.item"; the item may be a stretch "line(from..to)".
std::optional<Reference> split_reference(const std::string& text);

/// Looks names up in a garment and collects what is not there.
class Names {
 public:
  Names(const mesh::GarmentMesh& garment, Issues& issues);

  const std::vector<std::string>& panel_names() const { return panel_names_; }
  /// Panels that a pattern stands for, ascending; an issue where there is none.
  std::vector<int> panels(const std::string& pattern, const std::string& item);
  /// Those of several patterns together, ascending, each once.
  std::vector<int> panels(const std::vector<std::string>& patterns, const std::string& item);
  /// Panels of that name or cut from the piece of that name; no issue.
  std::vector<int> panels_of(const std::string& panel_or_piece) const;
  /// The panel that is cut as the mirror image of this one.
  std::optional<int> twin(int panel) const;

  struct Place {
    int vertex = 0;
    double off = 0;  ///< from the position asked for [m]
  };
  /// code  of issues about the end itself
  std::optional<Place> place(const FastenerEnd& end, const std::string& code, const std::string& item);
  /// The same place on the mirrored panel.
  std::optional<Place> mirrored_place(const FastenerEnd& end, const std::string& code, const std::string& item);

 private:
  std::optional<Place> nearest(int panel, const Eigen::RowVector2d& at, const std::string& code, const std::string& item);
  std::optional<int> point(int panel, const std::string& name, const std::string& item);
  const mesh::GarmentMesh& garment_;
  Issues& issues_;
  std::vector<std::string> panel_names_;
};

/// Pairs of the places of two lists; `b` empty: mirror images of those of `a`. Issues where they do not fit.
std::vector<std::pair<Names::Place, Names::Place>> pairs_of(Names& names, Issues& issues, const std::vector<FastenerEnd>& a, const std::vector<FastenerEnd>& b, const std::string& code, const std::string& item);

}  // namespace toile::tailor
