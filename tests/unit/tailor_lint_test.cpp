#include "toile/tailor/lint.h"

#include <gtest/gtest.h>

#include "garments.h"
#include "toile/tailor/sew.h"

using namespace toile;

namespace {

std::vector<std::string> codes(const Issues& issues) {
  std::vector<std::string> result;
  for (const Issue& issue : issues) {
    EXPECT_EQ(issue.category, Category::check);
    EXPECT_FALSE(issue.remedy.empty());
    result.push_back(issue.code);
  }
  return result;
}

}  // namespace

TEST(lint, a_sound_garment_has_no_fault) {
  const mesh::GarmentMesh g = test::two_panels(4);
  const tailor::Lint found = tailor::lint(g);
  EXPECT_TRUE(found.errors.empty()) << to_string(found.errors.front());
  EXPECT_TRUE(found.warnings.empty()) << to_string(found.warnings.front());
}

TEST(lint, everything_that_a_valid_file_can_get_wrong) {
  mesh::GarmentMesh g = test::two_panels(4);
  // Face 0 face down; face 3 closed to nothing by a weld; a vertex that no face has; runs beside the mesh and inside it.
  std::swap(g.faces(0, 1), g.faces(0, 2));
  g.welds.push_back({g.faces(3, 0), g.faces(3, 1), 0});
  const Eigen::Index lone = g.vertex_count();
  g.x.conservativeResize(lone + 1, 3);
  g.uv.conservativeResize(lone + 1, 2);
  g.vertex_panel.conservativeResize(lone + 1);
  g.x.row(lone).setZero();
  g.uv.row(lone).setZero();
  g.vertex_panel[lone] = 0;
  // Edge 'bottom' skips a vertex; 'top' runs one row too low.
  std::erase_if(g.run_vertices, [&](const mesh::RunVertex& r) { return r.run == 0 && r.vertex == 2; });
  for (mesh::RunVertex& r : g.run_vertices) {
    if (r.run == 2) r.vertex -= 5;
  }
  // A third face on an edge inside panel 0.
  const Eigen::Index n = g.face_count();
  g.faces.conservativeResize(n + 1, 3);
  g.face_panel.conservativeResize(n + 1);
  g.face_laminate.conservativeResize(n + 1);
  g.faces.row(n) << 6, 7, 18;
  g.face_panel[n] = 0;
  g.face_laminate[n] = -1;
  ASSERT_TRUE(mesh::validate(g).empty()) << to_string(mesh::validate(g).front());

  const tailor::Lint found = tailor::lint(g);
  EXPECT_EQ(codes(found.errors), (std::vector<std::string>{"turned_face", "degenerate_face", "branching_edge", "loose_vertex",
                                                           "run_off_mesh", "run_off_border"}));
  EXPECT_NE(found.errors[4].place.item.find("edge 'bottom'"), std::string::npos) << found.errors[4].place.item;
  EXPECT_NE(found.errors[5].what.find("the first of 4"), std::string::npos) << found.errors[5].what;
  EXPECT_EQ(codes(found.warnings), (std::vector<std::string>{"sharp_triangles", "partly_layered"}));
}

TEST(lint, simulated_garments_are_closed_and_at_rest) {
  mesh::GarmentMesh g = test::two_panels(4);
  g.marks["converged"] = "no";
  EXPECT_EQ(codes(tailor::lint(g).warnings), std::vector<std::string>{"not_converged"});
  g.route.push_back({.stage = "toile-simulate", .version = 1});
  EXPECT_EQ(codes(tailor::lint(g).warnings), (std::vector<std::string>{"not_converged", "far_welds"}));
}
