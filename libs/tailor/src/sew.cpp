#include "toile/tailor/sew.h"

#include "seam_plan.h"
#include "seam_sides.h"
#include "sewing_table.h"

#include "toile/mesh/topology.h"
#include "toile/tailor/quality.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;

/// What welding must not do to the surface.
Issues check_surface(const GarmentMesh& garment) {
  Issues issues;
  const mesh::Ids particle = mesh::particles(garment);
  const mesh::Triangles faces = mesh::mapped(garment.faces, particle);
  std::vector<char> welded(static_cast<std::size_t>(particle.size() ? particle.maxCoeff() + 1 : 0), 0);
  std::map<int, std::string> seam_of;
  for (const auto& weld : garment.welds) {
    welded[particle[weld.a]] = 1;
    seam_of.emplace(particle[weld.a], garment.seams[static_cast<std::size_t>(weld.seam)].name);
  }
  const auto item = [&](int id) { return "seam " + seam_of[id]; };
  std::map<std::array<int, 3>, Eigen::Index> seen;
  constexpr std::size_t enough = 20;
  for (Eigen::Index f = 0; f < faces.rows() && issues.size() < enough; ++f) {
    std::array<int, 3> v{faces(f, 0), faces(f, 1), faces(f, 2)};
    if (!welded[v[0]] && !welded[v[1]] && !welded[v[2]]) continue;
    const int place = garment.faces(f, 0);
    bool flat = false;
    for (int k = 0; k < 3; ++k) {
      if (v[k] != v[(k + 1) % 3]) continue;
      flat = true;
      issues.push_back({"degenerate_face", {.item = item(v[k])}, fmt::format("it closes a triangle of panel {} to nothing", place_text(garment, place)), "use smaller cells there, or end the seam before the corner", Category::check});
      break;
    }
    if (flat) continue;
    const int any = welded[v[0]] ? v[0] : welded[v[1]] ? v[1] : v[2];
    std::sort(v.begin(), v.end());
    const auto [twin, fresh] = seen.emplace(v, f);
    if (!fresh) issues.push_back({"folded_panel", {.item = item(any)}, fmt::format("it lays a triangle of panel {} onto one of panel {}", place_text(garment, place), place_text(garment, garment.faces(twin->second, 0))), "check the edges of the seam, or use smaller cells there", Category::check});
  }
  return issues;
}

}  // namespace

Result<Sewn> sew(const GarmentMesh& garment, const SewParams& params) {
  Issues issues;
  if (!garment.vertex_columns.empty() || !garment.face_columns.empty()) issues.push_back({"unsupported_columns", {}, "the garment has columns of later stages", "sew before the stages that add them"});
  if (!garment.laminates.empty()) issues.push_back({"already_layered", {}, "the garment has layers already", "sew before toile-layer"});
  // Folds that know their lines (pleats) get new hinges below.
  const bool lasting = std::any_of(garment.hinges.begin(), garment.hinges.end(), [&](const mesh::Hinge& h) { return h.fold < 0 || garment.folds[static_cast<std::size_t>(h.fold)].runs.empty(); });
  if (lasting || !garment.trim_segments.empty()) issues.push_back({"already_folded", {}, "the garment has folds or trims already", "sew first, or in the same spec"});
  if (!garment.welds.empty()) issues.push_back({"already_sewn", {}, "the garment is sewn already", "list all seams in one spec"});
  std::vector<Eigen::Vector3d> offset(garment.panels.size());
  std::vector<char> known(garment.panels.size(), 0);
  for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
    const std::size_t p = static_cast<std::size_t>(garment.vertex_panel[v]);
    const Eigen::Vector3d own = garment.x.row(v).transpose() - Eigen::Vector3d(garment.uv(v, 0), garment.uv(v, 1), 0);
    if (!known[p]) offset[p] = own, known[p] = 1;
    else if ((own - offset[p]).norm() > 1e-6) {
      issues.push_back({"not_flat", {.item = garment.panels[p].name}, "the panel does not lie flat", "sew before the garment is placed"});
      break;
    }
  }
  if (!issues.empty()) return issues;

  std::vector<const SeamSpec*> specs;
  for (const SeamSpec& spec : params.seams) specs.push_back(&spec);
  std::stable_sort(specs.begin(), specs.end(), [](const SeamSpec* a, const SeamSpec* b) { return a->name < b->name; });
  SewingTable table(garment);
  TOILE_TRY(const SeamPlan plan, plan_seams(garment, table.plan_runs(), specs, params));
  table.carry_out(plan.rows);
  if (const auto turned = table.turned_over()) {
    return Issue{"seam_conflict", {.item = garment.panels[static_cast<std::size_t>(table.panel(*turned))].name}, "the seams of this panel need its border particles moved farther than its grid allows", "use cells of similar size on both sides of its seams", Category::check};
  }

  // Places along the seams, by vertices of the table.
  Sewn result;
  result.notes = plan.notes;
  std::vector<std::vector<std::array<int, 2>>> welds(plan.bonds.size());
  std::vector<std::array<int, 2>> all;
  std::vector<int> tips;
  for (std::size_t b = 0; b < plan.bonds.size(); ++b) {
    const PlanBond& bond = plan.bonds[b];
    auto& line = result.lines.emplace_back();
    std::set<std::array<int, 2>> known;
    for (std::size_t k = 0; k < bond.nodes[0].size(); ++k) {
      const auto ids = [&](const PlanNode& node) {
        std::vector<int> list;
        for (const auto& [run, slot] : node.at) list.push_back(table.rows()[static_cast<std::size_t>(run)][static_cast<std::size_t>(slot)].second);
        return list;
      };
      line.push_back({ids(bond.nodes[0][k]), ids(bond.nodes[1][k])});
      for (int v : line.back().a) {
        for (int w : line.back().b) {
          if (v == w) tips.push_back(v);
          else if (known.insert({std::min(v, w), std::max(v, w)}).second) welds[b].push_back({v, w});
        }
      }
    }
    all.insert(all.end(), welds[b].begin(), welds[b].end());
    result.seams.push_back(bond.report);
  }
  std::sort(tips.begin(), tips.end());
  tips.erase(std::unique(tips.begin(), tips.end()), tips.end());
  for (int tip : tips) table.open_tip(tip);
  table.part_plies(all);

  auto [sewn, number] = table.result(offset);
  for (std::size_t b = 0; b < plan.bonds.size(); ++b) {
    const PlanBond& bond = plan.bonds[b];
    const SeamSpec& spec = *specs[static_cast<std::size_t>(bond.seam)];
    const int id = static_cast<int>(b);
    for (const auto& [v, w] : welds[b]) sewn.welds.push_back({number[v], number[w], id});
    for (SeamPlace& place : result.lines[b]) {
      for (auto* side : {&place.a, &place.b}) {
        for (int& v : *side) v = number[v];
      }
    }
    sewn.seams.push_back({id, bond.report.name, bond.side == 1 ? spec.kind : "further", bond.report.length_a, bond.report.length_b, spec.bending_factor.value_or(params.bending_factor)});
  }
  result.garment = std::move(sewn);
  // Folds that the panels came with: their hinges are on other triangles now.
  TOILE_TRY(result.garment.hinges, fold_hinges(result.garment));
  issues = check_surface(result.garment);
  if (!issues.empty()) return issues;
  return result;
}

}  // namespace toile::tailor
