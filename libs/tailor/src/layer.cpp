#include "toile/tailor/layer.h"

#include "line_part.h"
#include "names.h"
#include "region.h"

#include "toile/base/text.h"
#include "toile/mesh/remove_panels.h"
#include "toile/tailor/trim.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;

/// A piece of the garment that is laid on others and used up.
struct Template {
  Outline outline;    ///< of its plain copy
  double area = 0;    ///< of one copy [m2]
  std::string material;
};

/// A sheet of a face's stack: its card, and the layer it came with (-1: the cloth itself).
struct SheetId {
  int card = -1, layer = -1;
  bool mirrored = false;  ///< of a layer that is turned against the cloth: the turn is the mirror image
  auto operator<=>(const SheetId&) const = default;
};
using Stack = std::vector<SheetId>;

class Layering {
 public:
  Layering(const std::vector<fabric::Card>& cards, const LayerParams& params) : cards_(cards), params_(params) {}

  Result<Layered> run(const GarmentMesh& garment) {
    issues_ = validate(params_);
    for (const auto& card : cards_) {
      if (std::find(card_names_.begin(), card_names_.end(), card.name) != card_names_.end()) issues_.push_back({"duplicate_fabric", {}, fmt::format("two of the fabric files are named '{}'", card.name), "give each fabric its own name"});
      card_names_.push_back(card.name);
    }
    GarmentMesh bare = garment;
    bare.free_layers.clear();
    bare.closures.clear();
    bare.fasteners.clear();
    result_.garment = take_templates(bare);
    assign_cloth();
    stack_layers();

    auto free = free_layers(result_.garment, params_.free);
    if (free) result_.garment = std::move(*free);
    else append(issues_, free.issues());
    auto tacked = tack(result_.garment, params_.tacks);
    if (tacked) {
      result_.garment = std::move(tacked->garment);
      result_.farthest_snap = tacked->farthest_snap;
    } else {
      append(issues_, tacked.issues());
    }
    auto fastened = fasten(result_.garment, {params_.fasteners, params_.zips, params_.open, params_.closed});
    if (fastened) {
      result_.garment = std::move(fastened->garment);
      result_.farthest_snap = std::max(result_.farthest_snap, fastened->farthest_snap);
    } else {
      append(issues_, fastened.issues());
    }
    if (!issues_.empty()) return issues_;
    make_laminates();
    result_.garment = resolve_allowances(result_.garment);
    if (!issues_.empty()) return issues_;
    return std::move(result_);
  }

 private:
  int card_index(const std::string& name, const std::string& item) {
    const auto found = std::find(card_names_.begin(), card_names_.end(), name);
    if (found != card_names_.end()) return static_cast<int>(found - card_names_.begin());
    issues_.push_back({"unknown_fabric", {.item = item}, fmt::format("no fabric file describes '{}'", name), card_names_.empty() ? "give its card with --fabrics" : suggestion(name, card_names_)});
    return -1;
  }

  /// Outlines of the pieces that layers lay on; the garment without them.
  GarmentMesh take_templates(const GarmentMesh& garment) {
    Names names(garment, issues_);
    const auto faces = faces_by_panel(garment);
    const Eigen::VectorXd areas = mesh::rest_areas(garment);
    std::vector<char> taken(garment.panels.size(), 0);
    for (const BondedLayer& layer : params_.bonded) {
      if (layer.piece.empty() || templates_.count(layer.piece)) continue;
      const std::string item = "bonded " + layer.name;
      const std::vector<int> panels = names.panels_of(layer.piece);
      if (panels.empty()) {
        issues_.push_back({"unknown_panel", {.item = item}, fmt::format("there is no piece '{}'", layer.piece), suggestion(layer.piece, names.panel_names())});
        continue;
      }
      for (int p : panels) taken[static_cast<std::size_t>(p)] = 1;
      const auto& first = faces[static_cast<std::size_t>(panels.front())];
      Template piece{panel_outline(garment, panels.front(), first), 0, garment.panels[static_cast<std::size_t>(panels.front())].material};
      for (int f : first) piece.area += areas[f];
      templates_.emplace(layer.piece, std::move(piece));
    }
    const auto is_taken = [&](int vertex) { return taken[static_cast<std::size_t>(garment.vertex_panel[vertex])] != 0; };
    std::set<std::pair<int, int>> sewn;
    for (const auto& weld : garment.welds) {
      for (int v : {weld.a, weld.b}) {
        if (is_taken(v)) sewn.emplace(garment.vertex_panel[v], weld.seam);
      }
    }
    for (const auto& [panel, seam] : sewn) {
      const std::string& name = garment.panels[static_cast<std::size_t>(panel)].name;
      issues_.push_back({"piece_sewn", {.item = "panel " + name}, fmt::format("it is to be laid on other cloth, but seam {} sews it", garment.seams[static_cast<std::size_t>(seam)].name), "bond it or sew it; a layer that is sewn is a free one"});
    }
    if (!sewn.empty()) return garment;
    return mesh::without_panels(garment, taken);
  }

  void assign_cloth() {
    const GarmentMesh& garment = result_.garment;
    Names names(garment, issues_);
    std::vector<std::string> said_by(garment.panels.size());
    cloth_.assign(garment.panels.size(), -1);
    const int base = params_.base.empty() ? -1 : card_index(params_.base, "base");
    std::map<std::string, int> by_material;
    for (const auto& [material, fabric] : params_.materials) by_material[material] = card_index(fabric, "materials." + material);
    for (const auto& [pattern, fabric] : params_.panels) {
      const int card = card_index(fabric, "panels." + pattern);
      for (int panel : names.panels(pattern, "panels." + pattern)) {
        const auto p = static_cast<std::size_t>(panel);
        const std::string& name = names.panel_names()[p];
        // A panel's own name goes before patterns with *; two patterns for one panel are a contradiction.
        const bool own = pattern == name;
        if (!said_by[p].empty() && !own && said_by[p] != name) {
          issues_.push_back({"ambiguous_fabric", {.item = "panels." + pattern}, fmt::format("panel '{}' is also named by '{}'", name, said_by[p]), "name the panel itself"});
        }
        if (said_by[p] == name) continue;
        said_by[p] = pattern;
        cloth_[p] = card;
      }
    }
    std::set<std::string> used;
    for (const auto& panel : garment.panels) {
      const auto p = static_cast<std::size_t>(panel.id);
      const auto found = by_material.find(panel.material);
      if (found != by_material.end()) used.insert(panel.material);
      if (!said_by[p].empty()) continue;
      if (found != by_material.end()) cloth_[p] = found->second;
      else if (!params_.base.empty()) cloth_[p] = base;
      else {
        issues_.push_back({"no_fabric", {.item = "panel " + panel.name}, panel.material.empty() ? "nothing says what it is made of" : fmt::format("nothing says what its material '{}' is", panel.material),
                           panel.material.empty() ? "name it under `panels`, or give a `base`" : fmt::format("add `{}: FABRIC` to `materials`, or give a `base`", panel.material)});
      }
    }
    for (const auto& [name, piece] : templates_) used.insert(piece.material);
    for (const auto& [material, card] : by_material) {
      if (!used.count(material)) result_.notes.push_back({"unused_material", {.item = "materials." + material}, "no panel is cut from it", "see what toile-info says of the panels' materials"});
    }
  }

  /// A line of a panel, or a stretch of one, as a row of vertices. In a mirrored copy edges run the other way.
  Result<std::vector<int>> line_of(const std::string& panel, const std::string& name) const {
    auto row = find_row(result_.garment, panel + "." + name);
    const auto open = name.find('('), dots = name.find("..");
    if (!row && row.issues().front().code == "bad_range" && open < dots) {
      row = find_row(result_.garment, fmt::format("{}.{}({}..{})", panel, name.substr(0, open), name.substr(dots + 2, name.size() - dots - 3), name.substr(open + 1, dots - open - 1)));
    }
    return row;
  }

  /// Faces of one panel that a layer covers.
  std::vector<int> covered_faces(const BondedLayer& layer, int panel, const std::vector<int>& faces, const std::string& item) {
    const GarmentMesh& garment = result_.garment;
    std::vector<int> covered;
    if (!layer.outline.empty()) {
      const auto& row = garment.panels[static_cast<std::size_t>(panel)];
      Lines lines;
      const std::size_t before = issues_.size();
      for (const std::string& text : layer.outline) {
        const auto reference = split_reference(text);
        if (reference && reference->panel != row.name && reference->panel != row.piece) continue;
        auto line = line_of(row.name, reference ? reference->item : text);
        if (line) {
          lines.push_back(std::move(*line));
          continue;
        }
        Issue issue = line.issues().front();
        issue.place.item = item;
        issues_.push_back(issue);
      }
      if (issues_.size() > before) return {};
      if (lines.empty()) {
        issues_.push_back({"open_outline", {.item = item}, fmt::format("none of its lines is on panel '{}'", row.name), "name its lines too, or take the panel out"});
        return {};
      }
      auto found = layer.inside ? same_side(garment, panel, faces, lines, *layer.inside) : enclosed_by(garment, faces, lines);
      if (found) return std::move(*found);
      Issue issue = found.issues().front();
      issue.place.item = item;
      issues_.push_back(issue);
      return {};
    }
    if (!layer.piece.empty()) {
      const auto piece = templates_.find(layer.piece);
      if (piece == templates_.end()) return {};
      const double cosine = std::cos(layer.angle), sine = std::sin(layer.angle);
      for (int f : faces) {
        const Eigen::Vector2d from = plain_middle(garment, f) - Eigen::Vector2d(layer.at[0], layer.at[1]);
        if (piece->second.outline.contains({cosine * from.x() + sine * from.y(), cosine * from.y() - sine * from.x()})) covered.push_back(f);
      }
    } else if (!layer.region.empty()) {
      const Outline outline = polygon(layer.region);
      for (int f : faces) {
        if (outline.contains(plain_middle(garment, f))) covered.push_back(f);
      }
    } else {
      return faces;
    }
    if (covered.empty()) {
      issues_.push_back({"empty_region", {.item = item}, fmt::format("the region covers no part of panel '{}'", garment.panels[static_cast<std::size_t>(panel)].name), "check where it lies: panel coordinates, u across, v along the warp"});
    }
    return covered;
  }

  void stack_layers() {
    const GarmentMesh& garment = result_.garment;
    Names names(garment, issues_);
    const auto faces = faces_by_panel(garment);
    const Eigen::VectorXd areas = mesh::rest_areas(garment);
    stacks_.resize(static_cast<std::size_t>(garment.face_count()));
    for (std::size_t f = 0; f < stacks_.size(); ++f) stacks_[f] = {{cloth_[static_cast<std::size_t>(garment.face_panel[static_cast<Eigen::Index>(f)])], -1, false}};
    std::set<std::string> layer_names;
    for (std::size_t k = 0; k < params_.bonded.size(); ++k) {
      const BondedLayer& layer = params_.bonded[k];
      const std::string item = "bonded " + layer.name;
      if (!layer_names.insert(layer.name).second) issues_.push_back({"duplicate_name", {.item = item}, "two layers have this name", "rename one"});
      std::string fabric = layer.fabric;
      if (fabric.empty() && templates_.count(layer.piece)) {
        const std::string& material = templates_.at(layer.piece).material;
        const auto found = params_.materials.find(material);
        if (found != params_.materials.end()) fabric = found->second;
        else issues_.push_back({"unknown_fabric", {.item = item}, fmt::format("nothing says what fabric piece '{}' is of (its material is '{}')", layer.piece, material), "add `fabric: NAME`, or name the material under `materials`"});
      }
      const int card = fabric.empty() ? -1 : card_index(fabric, item);
      if (layer.rule.value_or(params_.rule) == fabric::Joint::sliding && !layer.pressure && !layer.bending_friction && !layer.shear_friction) {
        issues_.push_back({"bad_friction", {.item = item}, "it slides, and nothing says with what friction", "give `pressure` and `spacing` (such as 100 Pa and 150 mm), or `2HB` and `2HG`; they may be 0"});
      }
      std::vector<int> panels = names.panels(layer.panels, item);
      if (layer.panels.empty()) {
        std::set<int> named;
        for (const std::string& text : layer.outline) {
          const auto reference = split_reference(text);
          const auto found = reference ? names.panels_of(reference->panel) : std::vector<int>{};
          if (found.empty()) issues_.push_back({"unknown_panel", {.item = item}, reference ? fmt::format("there is no panel or piece '{}'", reference->panel) : fmt::format("'{}' names no panel", text), reference ? suggestion(reference->panel, names.panel_names()) : "write it as panel.line, or list the panels under `panels`"});
          named.insert(found.begin(), found.end());
        }
        panels.assign(named.begin(), named.end());
      }
      LayerReport report{layer.name, 0, std::nullopt};
      for (int panel : panels) {
        const bool mirrored = garment.panels[static_cast<std::size_t>(panel)].mirrored && layer.angle != 0;
        for (int f : covered_faces(layer, panel, faces[static_cast<std::size_t>(panel)], item)) {
          Stack& stack = stacks_[static_cast<std::size_t>(f)];
          stack.insert(layer.side == LayerSide::under ? stack.end() : stack.begin(), {card, static_cast<int>(k), mirrored});
          report.area += areas[f];
        }
        if (templates_.count(layer.piece)) report.piece_area = report.piece_area.value_or(0) + templates_.at(layer.piece).area;
      }
      result_.layers.push_back(report);
    }
  }

  /// Name of a stack that says what its sheets are: the cloth by its fabric, layers by their names, face side first.
  std::string stack_name(const Stack& stack) const {
    std::string name;
    for (const SheetId& sheet : stack) name += (name.empty() ? "" : "+") + (sheet.layer < 0 ? cards_[static_cast<std::size_t>(sheet.card)].name : params_.bonded[static_cast<std::size_t>(sheet.layer)].name) + (sheet.mirrored ? "_m" : "");
    return name;
  }

  /// How sheet `layer` is held to the one beside it.
  fabric::Bond bond_of(const BondedLayer& layer, const fabric::Card& own, const fabric::Card& beside) const {
    fabric::Bond bond;
    bond.joint = layer.rule.value_or(params_.rule);
    if (bond.joint != fabric::Joint::sliding) return bond;
    if (layer.pressure) {
      const auto friction = fabric::sliding_friction(own, beside, *layer.pressure, *layer.spacing);
      bond.bending_friction = friction.bending;
      bond.shear_friction = friction.shear;
    } else {
      bond.bending_friction = layer.bending_friction.value_or(0);
      bond.shear_friction = layer.shear_friction.value_or(0);
    }
    return bond;
  }

  void make_laminates() {
    GarmentMesh& garment = result_.garment;
    garment.laminates.clear();
    garment.fabrics.clear();
    std::map<Stack, int> laminate_of;
    std::set<int> used;
    std::set<std::string> names;
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      const Stack& stack = stacks_[static_cast<std::size_t>(f)];
      const auto [found, fresh] = laminate_of.emplace(stack, static_cast<int>(garment.laminates.size()));
      garment.face_laminate[f] = found->second;
      if (!fresh) continue;
      mesh::Laminate laminate;
      laminate.id = found->second;
      laminate.name = stack_name(stack);
      for (int copy = 2; !names.insert(laminate.name).second; ++copy) laminate.name = fmt::format("{}_{}", stack_name(stack), copy);
      std::vector<fabric::Sheet> sheets;
      for (const SheetId& sheet : stack) {
        const auto& card = cards_[static_cast<std::size_t>(sheet.card)];
        used.insert(sheet.card);
        const BondedLayer* layer = sheet.layer < 0 ? nullptr : &params_.bonded[static_cast<std::size_t>(sheet.layer)];
        laminate.plies.push_back({card.name, layer ? layer->name : "", card.areal_density});
        sheets.push_back({card, layer ? (sheet.mirrored ? -layer->angle : layer->angle) : 0});
      }
      // A layer is held to the sheet beside it on the cloth's side.
      std::vector<fabric::Bond> bonds;
      std::set<std::string> rules;
      for (std::size_t k = 1; k < stack.size(); ++k) {
        const bool upper = stack[k].layer < stack[k - 1].layer;  // the later of the two is the one on top
        const std::size_t own = upper ? k - 1 : k, beside = upper ? k : k - 1;
        bonds.push_back(bond_of(params_.bonded[static_cast<std::size_t>(stack[own].layer)], sheets[own].card, sheets[beside].card));
        for (const auto& [name, joint] : Choices<fabric::Joint>::names) {
          if (joint == bonds.back().joint) rules.insert(name);
        }
      }
      if (!rules.empty()) laminate.rule = fmt::format("{}", fmt::join(rules, "+"));
      auto equivalent = fabric::stacked(sheets, bonds, laminate.name);
      if (equivalent) laminate.equivalent = std::move(*equivalent);
      else append(issues_, equivalent.issues());
      garment.laminates.push_back(std::move(laminate));
    }
    for (int card : used) garment.fabrics.push_back(cards_[static_cast<std::size_t>(card)]);
    std::sort(garment.fabrics.begin(), garment.fabrics.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  }

  const std::vector<fabric::Card>& cards_;
  const LayerParams& params_;
  Issues issues_;
  std::vector<std::string> card_names_;
  std::map<std::string, Template> templates_;
  std::vector<int> cloth_;  ///< card of every panel
  std::vector<Stack> stacks_;
  Layered result_;
};

}  // namespace

Result<Layered> layer(const GarmentMesh& garment, const std::vector<fabric::Card>& cards, const LayerParams& params) { return Layering(cards, params).run(garment); }

}  // namespace toile::tailor
