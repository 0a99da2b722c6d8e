#include "results.h"
#include "toile/io/body_import.h"

#include "toile/io/file.h"
#include "toile/mesh/topology.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cstring>
#include <filesystem>
#include <functional>

using namespace toile;
using test::codes;

namespace {

/// A box of width 0.4, height 1.6, depth 0.3 m with corners at the origin; faces outward.
struct Box {
  mesh::Points3 x{8, 3};
  mesh::Triangles faces{12, 3};
  Box() {
    for (int i = 0; i < 8; ++i) x.row(i) << 0.4 * (i & 1), 1.6 * (i >> 1 & 1), 0.3 * (i >> 2 & 1);
    faces << 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5;
  }
};

std::string obj(const Box& box, double scale = 1) {
  std::string s;
  for (Eigen::Index i = 0; i < box.x.rows(); ++i) s += fmt::format("v {} {} {}\n", scale * box.x(i, 0), scale * box.x(i, 1), scale * box.x(i, 2));
  for (Eigen::Index f = 0; f < box.faces.rows(); ++f) s += fmt::format("f {} {} {}\n", box.faces(f, 0) + 1, box.faces(f, 1) + 1, box.faces(f, 2) + 1);
  return s;
}

std::string ascii_stl(const Box& box) {
  std::string s = "solid box\n";
  for (Eigen::Index f = 0; f < box.faces.rows(); ++f) {
    s += "facet normal 0 0 0\nouter loop\n";
    for (int k = 0; k < 3; ++k) s += fmt::format("vertex {} {} {}\n", box.x(box.faces(f, k), 0), box.x(box.faces(f, k), 1), box.x(box.faces(f, k), 2));
    s += "endloop\nendfacet\n";
  }
  return s + "endsolid box\n";
}

std::string binary_stl(const Box& box) {
  std::string s(80, ' ');
  const auto put = [&s](auto value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    s.append(bytes, sizeof value);
  };
  put(static_cast<std::uint32_t>(box.faces.rows()));
  for (Eigen::Index f = 0; f < box.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) put(0.0f);
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) put(static_cast<float>(box.x(box.faces(f, k), c)));
    }
    put(static_cast<std::uint16_t>(0));
  }
  return s;
}

std::string ply(const Box& box) {
  std::string s = fmt::format("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n", box.x.rows());
  s += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", box.faces.rows());
  for (Eigen::Index i = 0; i < box.x.rows(); ++i) s += fmt::format("{} {} {}\n", box.x(i, 0), box.x(i, 1), box.x(i, 2));
  for (Eigen::Index f = 0; f < box.faces.rows(); ++f) s += fmt::format("3 {} {} {}\n", box.faces(f, 0), box.faces(f, 1), box.faces(f, 2));
  return s;
}

/// glTF with the buffer inside, and a node that doubles the size and mirrors x.
std::string gltf(const Box& box, const std::string& node) {
  std::string bytes;
  const auto put = [&bytes](auto value) {
    char b[sizeof value];
    std::memcpy(b, &value, sizeof value);
    bytes.append(b, sizeof value);
  };
  for (Eigen::Index i = 0; i < box.x.size(); ++i) put(static_cast<float>(box.x.data()[i]));
  for (Eigen::Index i = 0; i < box.faces.size(); ++i) put(static_cast<std::uint16_t>(box.faces.data()[i]));
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string base64;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
    for (int k = 3; k >= 0; --k) base64 += i + (3 - k) > bytes.size() && k < 2 ? '=' : digits[word >> (6 * k) & 63];
  }
  return fmt::format(
      R"({{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0{}}}],
"meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
"accessors": [{{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [0.4, 1.6, 0.3]}},
{{"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}}],
"bufferViews": [{{"buffer": 0, "byteOffset": 0, "byteLength": 96}}, {{"buffer": 0, "byteOffset": 96, "byteLength": 72}}],
"buffers": [{{"byteLength": {}, "uri": "data:application/octet-stream;base64,{}"}}]}})",
      node, bytes.size(), base64);
}

class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / fmt::format("toile-body-{}", getpid())) { std::filesystem::create_directories(path_); }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::string write(const std::string& name, const std::string& bytes) const {
    const std::string file = (path_ / name).string();
    EXPECT_TRUE(ok(io::write_file(file, bytes)));
    return file;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace

TEST(body_import, every_format_gives_the_same_box) {
  const Folder folder;
  const Box box;
  const std::vector<std::pair<std::string, std::string>> files = {
      {"box.obj", obj(box)}, {"ascii.stl", ascii_stl(box)}, {"binary.stl", binary_stl(box)}, {"box.ply", ply(box)}, {"box.gltf", gltf(box, "")}};
  for (const auto& [name, bytes] : files) {
    const auto body = io::import_body(folder.write(name, bytes), {});
    ASSERT_TRUE(body) << name << " " << to_string(body.issues()[0]);
    EXPECT_EQ(body->mesh.x.rows(), 8) << name;
    EXPECT_EQ(body->mesh.faces.rows(), 12) << name;
    EXPECT_EQ(body->pieces.size(), 1u);
    EXPECT_NEAR(mesh::volume(body->mesh.x, body->mesh.faces), 0.4 * 1.6 * 0.3, 1e-7) << name;
    EXPECT_TRUE(ok(mesh::validate(body->mesh)));
  }
}

TEST(body_import, hollow_polygons_are_cut_into_triangles) {
  // An L-shaped prism: two six-sided ends and six quadrangles.
  const Folder folder;
  const std::vector<std::array<double, 2>> outline = {{0, 0}, {1, 0}, {1, 0.25}, {0.25, 0.25}, {0.25, 1}, {0, 1}};
  std::string s;
  for (const double z : {0.0, 0.5}) {
    for (const auto& p : outline) s += fmt::format("v {} {} {}\n", p[0], p[1], z);
  }
  s += "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n";
  for (int i = 0; i < 6; ++i) s += fmt::format("f {} {} {} {}\n", i + 1, (i + 1) % 6 + 1, (i + 1) % 6 + 7, i + 7);
  const auto body = io::import_body(folder.write("prism.obj", s), {});
  ASSERT_TRUE(body) << to_string(body.issues()[0]);
  EXPECT_EQ(body->mesh.faces.rows(), 20);
  EXPECT_NEAR(mesh::volume(body->mesh.x, body->mesh.faces), (0.25 + 0.75 * 0.25) * 0.5, 1e-7);
  // No triangle crosses the notch: the two ends have exactly the outline's area.
  double area = 0;
  for (Eigen::Index f = 0; f < body->mesh.faces.rows(); ++f) {
    const Eigen::Vector3d a = body->mesh.x.row(body->mesh.faces(f, 0)), b = body->mesh.x.row(body->mesh.faces(f, 1)), c = body->mesh.x.row(body->mesh.faces(f, 2));
    area += (b - a).cross(c - a).norm() / 2;
  }
  EXPECT_NEAR(area, 2 * 0.4375 + 4 * 0.5, 1e-6);
}

TEST(body_import, a_node_that_mirrors_keeps_faces_outward) {
  const Folder folder;
  const auto body = io::import_body(folder.write("mirror.gltf", gltf(Box(), R"(, "scale": [-1.5, 1.5, 1.5])")), {});
  ASSERT_TRUE(body) << to_string(body.issues()[0]);
  EXPECT_NEAR(body->mesh.x.col(0).minCoeff(), -0.6, 1e-6);
  EXPECT_NEAR(mesh::volume(body->mesh.x, body->mesh.faces), 3.375 * 0.192, 1e-6);
}

TEST(body_import, units_and_axes) {
  const Box box;
  for (const auto& [unit, scale] : {std::pair{io::LengthUnit::cm, 100.0}, {io::LengthUnit::mm, 1000.0}, {io::LengthUnit::in, 1 / 0.0254}}) {
    io::BodyImportParams p;
    p.unit = unit;
    const auto body = io::import_body(box.x * scale, box.faces, "box", p);
    ASSERT_TRUE(body);
    EXPECT_NEAR(body->mesh.x.col(1).maxCoeff(), 1.6, 1e-12);
  }
  // A file with z up and -y facing: (x, y, z) of the world is (x, z, -y) of the file.
  mesh::Points3 turned(8, 3);
  turned.col(0) = box.x.col(0), turned.col(1) = -box.x.col(2), turned.col(2) = box.x.col(1);
  io::BodyImportParams p;
  p.up = io::Axis::z, p.facing = io::Axis::minus_y;
  const auto body = io::import_body(turned, box.faces, "box", p);
  ASSERT_TRUE(body) << to_string(body.issues()[0]);
  const Eigen::RowVector3d high = body->mesh.x.colwise().maxCoeff(), low = body->mesh.x.colwise().minCoeff();
  EXPECT_TRUE(high.isApprox(Eigen::RowVector3d(0.4, 1.6, 0.3)));
  EXPECT_TRUE(low.isZero());
  p.facing = io::Axis::minus_z;
  EXPECT_EQ(codes(io::import_body(turned, box.faces, "box", p)), "bad_axes");
}

TEST(body_import, stands_on_the_floor_when_asked) {
  const Box box;
  io::BodyImportParams p;
  p.standing = io::Standing::floor;
  const auto body = io::import_body(box.x.rowwise() + Eigen::RowVector3d(0, -0.7, 0), box.faces, "box", p);
  ASSERT_TRUE(body);
  EXPECT_EQ(body->mesh.x.col(1).minCoeff(), 0);
}

TEST(body_import, pieces_are_told_apart) {
  const Box box;
  mesh::Points3 x(16, 3);
  x << box.x * 0.1, box.x.rowwise() + Eigen::RowVector3d(0.5, 0, 0);
  mesh::Triangles faces(24, 3);
  faces << box.faces, (box.faces.array() + 8).matrix();
  const auto both = io::import_body(x, faces, "two", {});
  ASSERT_TRUE(both);
  ASSERT_EQ(both->pieces.size(), 2u);
  EXPECT_NEAR(both->pieces[0].volume, 0.192, 1e-12);
  EXPECT_NEAR(both->pieces[1].volume, 0.000192, 1e-15);
  EXPECT_EQ(mesh::component_count(both->mesh.faces), 2);
  io::BodyImportParams p;
  p.pieces = io::Pieces::largest;
  const auto one = io::import_body(x, faces, "two", p);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->mesh.x.rows(), 8);
  EXPECT_EQ(one->pieces.size(), 2u);
  // The small one open: an error, unless it is left out.
  const auto open = io::import_body(x, faces.bottomRows(23), "two", {});
  EXPECT_EQ(codes(open), "open_surface");
  EXPECT_TRUE(io::import_body(x, faces.bottomRows(23), "two", p));
}

TEST(body_import, must_fail) {
  const Folder folder;
  const Box box;
  Box inward = box;
  inward.faces.col(1).swap(inward.faces.col(2));
  Box open = box;
  open.faces.conservativeResize(10, 3);
  Box mixed = box;
  std::swap(mixed.faces(4, 1), mixed.faces(4, 2));
  Box crowded = box;
  crowded.x.conservativeResize(9, 3);
  crowded.x.row(8) << 0.8, 0.8, 0.1;
  crowded.faces.conservativeResize(13, 3);
  crowded.faces.row(12) << 1, 3, 8;
  const std::vector<std::pair<std::string, std::string>> rows = {
      {codes(io::import_body(folder.write("inward.obj", obj(inward)), {})), "inside_out"},
      {codes(io::import_body(folder.write("open.obj", obj(open)), {})), "open_surface"},
      {codes(io::import_body(folder.write("mixed.obj", obj(mixed)), {})), "not_oriented"},
      {codes(io::import_body(folder.write("crowded.obj", obj(crowded)), {})), "open_surface not_manifold"},
      {codes(io::import_body(folder.write("mm.obj", obj(box, 1000)), {})), "implausible_size"},
      {codes(io::import_body(folder.write("mm_open.obj", obj(open, 1000)), {})), "implausible_size open_surface"},
      {codes(io::import_body(folder.write("empty.obj", ""), {})), "cannot_read"},
      {codes(io::import_body(folder.write("empty.stl", ""), {})), "cannot_read"},
      {codes(io::import_body(folder.write("letter.obj", "Dear tailor,\nmy waist is 90 cm.\n"), {})), "cannot_read"},
      {codes(io::import_body(folder.write("letter.stl", "Dear tailor,\nmy waist is 90 cm.\n"), {})), "cannot_read"},
      {codes(io::import_body(folder.write("letter.txt", "Dear tailor,\n"), {})), "cannot_read"},
      {codes(io::import_body(folder.write("cut.ply", ply(box).substr(0, 180)), {})), "cannot_read"},
      {codes(io::import_body(folder.write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), {})), "cannot_read"},
      {codes(io::import_body(folder.write("gone.obj", obj(box)) + "x", {})), "cannot_read"},
  };
  for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i].first, rows[i].second) << "row " << i;
}

TEST(body_import, the_error_names_the_unit_that_fits_and_the_place_of_a_hole) {
  const Box box;
  const auto size = io::import_body(box.x * 1000, box.faces, "box", {});
  ASSERT_FALSE(size);
  EXPECT_NE(size.issues()[0].remedy.find("unit mm would make it 1.6 m"), std::string::npos) << size.issues()[0].remedy;
  mesh::Triangles faces = box.faces;
  const auto hole = io::import_body(box.x, faces.topRows(11), "box", {});
  ASSERT_FALSE(hole);
  EXPECT_NE(hole.issues()[0].what.find("3 edges"), std::string::npos) << hole.issues()[0].what;
  EXPECT_NE(hole.issues()[0].what.find("(0.400, 1.600, 0.150) m"), std::string::npos) << hole.issues()[0].what;
}

TEST(body_import, winding_can_be_mended) {
  const Box box;
  io::BodyImportParams p;
  p.winding = io::Winding::outward;
  mesh::Triangles faces = box.faces;
  for (const int f : {0, 3, 4, 7, 11}) std::swap(faces(f, 0), faces(f, 1));
  const auto body = io::import_body(box.x, faces, "box", p);
  ASSERT_TRUE(body) << to_string(body.issues()[0]);
  EXPECT_NEAR(mesh::volume(body->mesh.x, body->mesh.faces), 0.192, 1e-12);
  faces = box.faces;
  faces.col(0).swap(faces.col(2));
  const auto turned = io::import_body(box.x, faces, "box", p);
  ASSERT_TRUE(turned);
  EXPECT_NEAR(mesh::volume(turned->mesh.x, turned->mesh.faces), 0.192, 1e-12);
}

namespace {

/// A closed prism of 24 sides about y, radius 0.2 m, from y = 0 to 1; its lid is left out if `open`.
std::pair<mesh::Points3, mesh::Triangles> drum(bool open) {
  constexpr int n = 24;
  mesh::Points3 x(2 * n + 2, 3);
  for (int i = 0; i < n; ++i) {
    const double a = 2 * M_PI * i / n;
    x.row(i) << 0.2 * std::cos(a), 0, -0.2 * std::sin(a);
    x.row(n + i) << 0.2 * std::cos(a), 1, -0.2 * std::sin(a);
  }
  x.row(2 * n) << 0, 0, 0;
  x.row(2 * n + 1) << 0, 1, 0;
  mesh::Triangles faces((open ? 3 : 4) * n, 3);
  for (int i = 0; i < n; ++i) {
    const int j = (i + 1) % n;
    faces.row(3 * i) << i, j, n + j;
    faces.row(3 * i + 1) << i, n + j, n + i;
    faces.row(3 * i + 2) << 2 * n, j, i;
    if (!open) faces.row(3 * n + i) << 2 * n + 1, n + i, n + j;
  }
  return {x, faces};
}

}  // namespace

TEST(body_import, a_wrap_bridges_holes_narrower_than_it_and_names_wider_ones) {
  const auto [x, faces] = drum(true);
  io::BodyImportParams p;
  EXPECT_EQ(codes(io::import_body(x, faces, "drum", p)), "open_surface");
  const double whole = 12 * std::sin(2 * M_PI / 24) * 0.04;  // of the prism with its lid
  p.wrap_offset = 2e-3;
  for (const double width : {0.45, 0.8}) {
    p.wrap = width;
    const auto body = io::import_body(x, faces, "drum", p);
    ASSERT_TRUE(body) << to_string(body.issues()[0]);
    EXPECT_EQ(body->open_edges, 24);
    const double volume = mesh::volume(body->mesh.x, body->mesh.faces);
    EXPECT_GT(volume, 0.9 * whole) << width;   // the open end is bridged by a dent
    EXPECT_LT(volume, 1.05 * whole) << width;  // and 2 mm are added all round
    // The open end apart, no vertex is nearer than the offset, or farther.
    EXPECT_GE(body->wrap_distance, p.wrap_offset - 1e-6);
    for (Eigen::Index i = 0; i < body->mesh.x.rows(); ++i) {
      const Eigen::RowVector3d q = body->mesh.x.row(i);
      if (q.y() < 0.1 || q.y() > 0.9) continue;
      const double r = std::hypot(q.x(), q.z());
      EXPECT_GT(r, 0.2 * std::cos(M_PI / 24) + 0.99 * p.wrap_offset);
      EXPECT_LT(r, 0.2 + 1.01 * p.wrap_offset);
    }
  }
  p.wrap = 0.3;
  EXPECT_EQ(codes(io::import_body(x, faces, "drum", p)), "wrap_enters");
}

TEST(body_import, a_wrap_takes_pieces_that_cross_and_faces_turned_inward) {
  auto [x, faces] = drum(false);
  for (Eigen::Index f = 0; f < faces.rows(); f += 3) std::swap(faces(f, 1), faces(f, 2));
  mesh::Points3 both(2 * x.rows(), 3);
  both << x, (0.5 * x).rowwise() + Eigen::RowVector3d(0.15, 0.25, 0);  // a half-size drum that sticks out at +x
  mesh::Triangles all(2 * faces.rows(), 3);
  all << faces, faces.array() + static_cast<int>(x.rows());
  io::BodyImportParams p;
  EXPECT_EQ(codes(io::import_body(both, all, "drums", p)), "not_oriented");
  p.wrap = 0.04;
  const auto body = io::import_body(both, all, "drums", p);
  ASSERT_TRUE(body) << to_string(body.issues()[0]);
  EXPECT_EQ(body->open_edges, 0);
  const auto again = io::import_body(both, all, "drums", p);
  ASSERT_TRUE(again);
  EXPECT_EQ(body->mesh.x, again->mesh.x);
  EXPECT_EQ(body->mesh.faces, again->mesh.faces);
  EXPECT_NEAR(body->mesh.x.col(0).maxCoeff(), 0.25 + p.wrap_offset, 1e-4);
  EXPECT_TRUE(ok(mesh::validate(body->mesh)));
}

namespace {

/// The box with each side cut into n x n squares; side k (as in the order of axes, low before high) is part k.
struct FineBox {
  mesh::Points3 x;
  mesh::Triangles faces;
  io::FaceMarks marks;
  explicit FineBox(int n) {
    const Eigen::Vector3d size(0.4, 1.6, 0.3);
    std::vector<Eigen::Vector3d> points;
    std::vector<std::array<int, 3>> triangles;
    for (int axis = 0; axis < 3; ++axis) {
      for (int high = 0; high < 2; ++high) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3, base = static_cast<int>(points.size());
        for (int i = 0; i <= n; ++i) {
          for (int j = 0; j <= n; ++j) {
            Eigen::Vector3d p = Eigen::Vector3d::Zero();
            p[axis] = high * size[axis];
            p[u] = size[u] * i / n;
            p[v] = size[v] * j / n;
            points.push_back(p);
          }
        }
        for (int i = 0; i < n; ++i) {
          for (int j = 0; j < n; ++j) {
            const int a = base + i * (n + 1) + j, b = a + n + 1;
            std::array<std::array<int, 3>, 2> halves{{{a, b, b + 1}, {a, b + 1, a + 1}}};
            for (auto& t : halves) {
              if (high == 0) std::swap(t[1], t[2]);
              triangles.push_back(t);
              marks.part.push_back(2 * axis + high);
            }
          }
        }
      }
    }
    x.resize(static_cast<Eigen::Index>(points.size()), 3);
    for (std::size_t i = 0; i < points.size(); ++i) x.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
    faces.resize(static_cast<Eigen::Index>(triangles.size()), 3);
    for (std::size_t f = 0; f < triangles.size(); ++f) faces.row(static_cast<Eigen::Index>(f)) << triangles[f][0], triangles[f][1], triangles[f][2];
    for (const char* side : {"right", "left", "bottom", "top", "back", "front"}) marks.parts.push_back({side, ""});
    for (const int part : marks.part) marks.color.push_back(part == 3 ? 0xff8000 : -1);
  }
};

double area(const mesh::SupportMesh& body, const std::string& region) {
  double sum = 0;
  for (Eigen::Index f = 0; f < body.faces.rows(); ++f) {
    const int id = body.face_region[f];
    const std::string own = id < 0 ? "" : body.region_names[static_cast<std::size_t>(id)];
    const Eigen::Vector3d a = body.x.row(body.faces(f, 0)), b = body.x.row(body.faces(f, 1)), c = body.x.row(body.faces(f, 2));
    if (own == region) sum += (b - a).cross(c - a).norm() / 2;
  }
  return sum;
}

}  // namespace

TEST(body_import, regions_by_part_color_box_and_landmark) {
  const FineBox box(10);
  io::BodyImportParams params;
  params.regions = {{.name = "belly", .part = "front"}, {.name = "lid", .color = "FF8001"}, {.name = "foot", .box = {-1, -1, -1, 1, 0.16, 1}},
                    {.name = "port", .landmarks = {"port"}}, {.name = "starboard", .landmarks = {"starboard"}}};
  params.landmarks = {{"port", {0.41, 0.8, 0.15}}, {"starboard", {-0.005, 0.8, 0.15}}};
  const auto body = io::import_body(box.x, box.faces, "box", params, box.marks);
  ASSERT_TRUE(body) << to_string(body.issues()[0]);
  EXPECT_NEAR(area(body->mesh, "belly"), 0.4 * 1.44, 1e-9);  // its lowest tenth belongs to the later region
  EXPECT_NEAR(area(body->mesh, "lid"), 0.4 * 0.3, 1e-9);
  EXPECT_NEAR(area(body->mesh, "foot"), 0.4 * 0.3 + 1.4 * 0.16, 1e-9);
  EXPECT_NEAR(area(body->mesh, ""), 0, 1e-12);
  // The back is shared by the two landmarks' regions, along its middle but for a row of triangles.
  EXPECT_NEAR(area(body->mesh, "port"), (0.3 + 0.2) * 1.44, 0.04 * 1.44);
  EXPECT_NEAR(area(body->mesh, "starboard"), (0.3 + 0.2) * 1.44, 0.04 * 1.44);
  EXPECT_NEAR(body->mesh.landmarks.at("port")[0], 0.4, 1e-15);
  EXPECT_NEAR(body->mesh.landmarks.at("port")[1], 0.8, 1e-15);
  EXPECT_NEAR(body->mesh.landmarks.at("starboard")[0], 0, 1e-15);
}

TEST(body_import, a_wrap_has_the_parts_of_the_scan_under_it) {
  const FineBox box(10);
  io::BodyImportParams params;
  params.wrap = 0.06;
  params.regions = {{.name = "belly", .part = "front"}};
  const auto body = io::import_body(box.x, box.faces, "box", params, box.marks);
  ASSERT_TRUE(body) << to_string(body.issues()[0]);
  EXPECT_NEAR(area(body->mesh, "belly"), 0.4 * 1.6, 0.05 * 0.4 * 1.6);
  for (Eigen::Index f = 0; f < body->mesh.faces.rows(); ++f) {
    const double z = (body->mesh.x(body->mesh.faces(f, 0), 2) + body->mesh.x(body->mesh.faces(f, 1), 2) + body->mesh.x(body->mesh.faces(f, 2), 2)) / 3;
    if (body->mesh.face_region[f] == 0) EXPECT_GT(z, 0.27);
    else EXPECT_LT(z, 0.302);
  }
}

TEST(body_import, regions_and_landmarks_that_are_nowhere) {
  const FineBox box(4);
  io::BodyImportParams params;
  params.regions = {{.name = "a", .part = "sleeve"}, {.name = "b", .color = "00ff00"}, {.name = "c", .box = {2, 2, 2, 3, 3, 3}}, {.name = "d", .landmarks = {"nose"}}};
  params.landmarks = {{"ear", {0.43, 0.8, 0.15}}};
  const auto body = io::import_body(box.x, box.faces, "box", params, box.marks);
  EXPECT_EQ(codes(body), "off_surface empty_region empty_region empty_region unknown_landmark");
  params.regions = {{.name = "a"}, {.name = "b", .part = "front", .color = "00ff00"}, {.name = "c", .box = {0, 0, 0}}, {.name = "d", .color = "red"}};
  EXPECT_EQ(codes(io::import_body(box.x, box.faces, "box", params, box.marks)), "bad_combination bad_combination bad_range bad_range");
}

TEST(body_import, groups_and_painted_vertices_come_from_files) {
  const Folder folder;
  const Box box;
  std::string grouped;
  for (Eigen::Index i = 0; i < 8; ++i) grouped += fmt::format("v {} {} {}\n", box.x(i, 0), box.x(i, 1), box.x(i, 2));
  for (Eigen::Index f = 0; f < 12; ++f) {
    if (f % 2 == 0) grouped += fmt::format("g side{}\n", f / 2);
    grouped += fmt::format("f {} {} {}\n", box.faces(f, 0) + 1, box.faces(f, 1) + 1, box.faces(f, 2) + 1);
  }
  io::BodyImportParams params;
  params.regions = {{.name = "front", .part = "side1"}};
  const auto by_group = io::import_body(folder.write("grouped.obj", grouped), params);
  ASSERT_TRUE(by_group) << to_string(by_group.issues()[0]);
  EXPECT_NEAR(area(by_group->mesh, "front"), 0.4 * 1.6, 1e-7);
  for (Eigen::Index f = 0; f < 12; ++f) {
    if (by_group->mesh.face_region[f] != 0) continue;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(by_group->mesh.x(by_group->mesh.faces(f, k), 2), 0.3, 1e-7);
  }

  std::string painted = fmt::format("ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
                                    "property uchar blue\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n");
  for (Eigen::Index i = 0; i < 8; ++i) painted += fmt::format("{} {} {} {}\n", box.x(i, 0), box.x(i, 1), box.x(i, 2), box.x(i, 2) > 0.1 ? "255 128 0" : "9 9 9");
  for (Eigen::Index f = 0; f < 12; ++f) painted += fmt::format("3 {} {} {}\n", box.faces(f, 0), box.faces(f, 1), box.faces(f, 2));
  params.regions = {{.name = "dark", .color = "0a0a0a"}, {.name = "orange", .color = "ff8000"}};
  const auto by_paint = io::import_body(folder.write("painted.ply", painted), params);
  ASSERT_TRUE(by_paint) << to_string(by_paint.issues()[0]);
  // Front and back are of one colour, and each triangle of the four sides between has two corners of one.
  const double sides = 2 * (0.4 * 0.3 + 1.6 * 0.3);
  EXPECT_NEAR(area(by_paint->mesh, "orange"), 0.4 * 1.6 + sides / 2, 1e-7);
  EXPECT_NEAR(area(by_paint->mesh, "dark"), 0.4 * 1.6 + sides / 2, 1e-7);
}
