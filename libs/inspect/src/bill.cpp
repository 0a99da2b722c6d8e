#include "toile/inspect/bill.h"

#include <map>
#include <utility>

namespace toile::inspect {

std::vector<StackRow> stack_table(const mesh::GarmentMesh& g) {
  const Eigen::VectorXd areas = mesh::rest_areas(g);
  std::map<std::pair<int, int>, double> sums;
  for (Eigen::Index f = 0; f < g.face_count(); ++f) sums[{g.face_panel[f], g.face_laminate[f]}] += areas[f];
  std::vector<StackRow> rows;
  for (const auto& [key, area] : sums) rows.push_back({key.first, key.second, area});
  return rows;
}

Bill bill_of_materials(const mesh::GarmentMesh& g) {
  Bill bill;
  std::map<std::string, FabricRow> fabrics;
  std::vector<char> counted(g.panels.size(), 0);
  for (const StackRow& row : stack_table(g)) {
    if (row.laminate < 0) {
      bill.area_without_fabric += row.area;
      continue;
    }
    for (const mesh::Ply& ply : g.laminates[static_cast<std::size_t>(row.laminate)].plies) {
      FabricRow& fabric = fabrics[ply.fabric];
      fabric.area += row.area;
      fabric.area_with_allowances += row.area;
      fabric.mass += row.area * ply.areal_density;
      // The allowances are cut from the panel's cloth; bonded layers have none.
      if (!ply.layer.empty() || counted[static_cast<std::size_t>(row.panel)]) continue;
      counted[static_cast<std::size_t>(row.panel)] = 1;
      fabric.area_with_allowances += g.panels[static_cast<std::size_t>(row.panel)].allowance_area;
    }
  }
  for (auto& [name, row] : fabrics) {
    row.fabric = name;
    bill.mass += row.mass;
    bill.fabrics.push_back(row);
  }

  std::map<std::string, SeamRow> seams;
  for (const mesh::Seam& seam : g.seams) {
    SeamRow& row = seams[seam.kind];
    ++row.count;
    row.length_a += seam.length_a;
    row.length_b += seam.length_b;
  }
  for (auto& [kind, row] : seams) {
    row.kind = kind;
    bill.seams.push_back(row);
  }

  std::map<std::string, TrimRow> trims;
  for (const mesh::Trim& trim : g.trims) ++trims[trim.kind].count;
  for (const mesh::TrimSegment& segment : g.trim_segments) {
    const mesh::Trim& trim = g.trims[static_cast<std::size_t>(segment.trim)];
    trims[trim.kind].length += segment.rest_length;
    trims[trim.kind].mass += segment.mass(trim);
  }
  for (auto& [kind, row] : trims) {
    row.kind = kind;
    bill.mass += row.mass;
    bill.trims.push_back(row);
  }

  static constexpr const char* kinds[] = {"button", "hook", "snap", "zip"};
  std::map<std::pair<std::string, double>, int> items;
  std::map<int, double> zips;
  for (const mesh::Fastener& fastener : g.fasteners) {
    if (fastener.kind == mesh::Fastener::Kind::zip) zips[fastener.closure] += fastener.mass;
    else ++items[{kinds[static_cast<int>(fastener.kind)], fastener.mass}];
  }
  for (const auto& [closure, mass] : zips) ++items[{"zip", mass}];
  for (const auto& [key, count] : items) {
    bill.fasteners.push_back({key.first, count, key.second, count * key.second});
    bill.mass += bill.fasteners.back().mass;
  }
  return bill;
}

Json to_json(const Bill& bill) {
  Json fabrics = Json::array(), seams = Json::array(), trims = Json::array(), fasteners = Json::array();
  for (const FabricRow& r : bill.fabrics) fabrics.push(Json::object().set("fabric", r.fabric).set("area", r.area).set("area_with_allowances", r.area_with_allowances).set("mass", r.mass));
  for (const SeamRow& r : bill.seams) seams.push(Json::object().set("kind", r.kind).set("count", r.count).set("length_a", r.length_a).set("length_b", r.length_b));
  for (const TrimRow& r : bill.trims) trims.push(Json::object().set("kind", r.kind).set("count", r.count).set("length", r.length).set("mass", r.mass));
  for (const FastenerRow& r : bill.fasteners) fasteners.push(Json::object().set("kind", r.kind).set("count", r.count).set("mass_each", r.mass_each).set("mass", r.mass));
  Json out = Json::object();
  out.set("fabrics", std::move(fabrics)).set("seams", std::move(seams)).set("trims", std::move(trims)).set("fasteners", std::move(fasteners));
  out.set("mass", bill.mass).set("area_without_fabric", bill.area_without_fabric);
  return out;
}

}  // namespace toile::inspect
