#include "toile/io/export.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <assimp/Importer.hpp>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "shapes.h"

namespace toile::io {
namespace {

mesh::GarmentMesh sample() {
  auto g = shapes::tube(0.2, 0.4, 12, 5, 1);
  shapes::add_panel(g, "patch pocket", 0.1, 0.12, 3, 4, {0.3, 1, 0.2});
  auto second = g.laminates[0];
  second.id = 1;
  second.name = "canvas";
  second.equivalent.color = {0.5, 0.25, 1};
  g.laminates.push_back(second);
  for (Eigen::Index f = 0; f < 7; ++f) g.face_laminate[f] = 1;
  g.face_columns["strain_warp"] = {false, std::vector<double>(static_cast<std::size_t>(g.face_count()), 0.125), {}};
  g.vertex_columns["tag"] = {true, {}, std::vector<int>(static_cast<std::size_t>(g.vertex_count()), 7)};
  return g;
}

struct Read {
  Assimp::Importer importer;
  const aiScene* scene = nullptr;
  Read(const std::string& bytes, const char* hint) {
    scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), aiProcess_ValidateDataStructure, hint);
    EXPECT_NE(scene, nullptr) << importer.GetErrorString();
  }
  unsigned faces() const {
    unsigned n = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) n += scene->mMeshes[m]->mNumFaces;
    return n;
  }
};

double area_of(const aiMesh& m) {
  double area = 0;
  for (unsigned f = 0; f < m.mNumFaces; ++f) {
    Eigen::Vector3d p[3];
    for (unsigned k = 0; k < 3; ++k) {
      const aiVector3D& v = m.mVertices[m.mFaces[f].mIndices[k]];
      p[k] = {v.x, v.y, v.z};
    }
    area += 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).norm();
  }
  return area;
}

double texture_area_of(const aiMesh& m) {
  double area = 0;
  for (unsigned f = 0; f < m.mNumFaces; ++f) {
    const auto at = [&](unsigned k) { return m.mTextureCoords[0][m.mFaces[f].mIndices[k]]; };
    const aiVector3D d = at(1) - at(0), e = at(2) - at(0);
    area += 0.5 * (d.x * e.y - d.y * e.x);
  }
  return area;
}

double area_of(const mesh::GarmentMesh& g) {
  double area = 0;
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    const Eigen::Vector3d a = g.x.row(g.faces(f, 0)), b = g.x.row(g.faces(f, 1)), c = g.x.row(g.faces(f, 2));
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  return area;
}

TEST(ExportObj, is_read_back_with_panels_and_pattern_coordinates) {
  const auto g = sample();
  for (const SeamPoints seams : {SeamPoints::separate, SeamPoints::merged}) {
    const Read read(format_obj(g, seams), "obj");
    ASSERT_NE(read.scene, nullptr);
    EXPECT_EQ(read.faces(), static_cast<unsigned>(g.face_count()));
    std::set<std::string> names;
    double area = 0, texture = 0;
    for (unsigned m = 0; m < read.scene->mNumMeshes; ++m) {
      const aiMesh& part = *read.scene->mMeshes[m];
      names.insert(part.mName.C_Str());
      ASSERT_TRUE(part.HasTextureCoords(0));
      ASSERT_TRUE(part.HasNormals());
      area += area_of(part);
      texture += texture_area_of(part);
    }
    EXPECT_EQ(names, (std::set<std::string>{"tube", "patch_pocket"}));
    EXPECT_NEAR(area, area_of(g), 1e-5);
    EXPECT_NEAR(texture, mesh::rest_areas(g).sum(), 1e-5) << "panel coordinates in metres, not mirrored";
  }
}

TEST(ExportObj, merged_seams_share_points) {
  const auto g = sample();
  const auto count = [](const std::string& text, const std::string& key) {
    std::size_t n = 0;
    for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) ++n;
    return n;
  };
  const auto vertices = static_cast<std::size_t>(g.vertex_count());
  EXPECT_EQ(count(format_obj(g, SeamPoints::separate), "\nv "), vertices);
  const std::string merged = format_obj(g, SeamPoints::merged);
  EXPECT_EQ(count(merged, "\nv "), vertices - g.welds.size());
  EXPECT_EQ(count(merged, "\nvt "), vertices);
}

TEST(ExportGltf, is_read_back_in_both_containers) {
  const auto g = sample();
  for (const GltfContainer container : {GltfContainer::json, GltfContainer::binary}) {
    const Read read(format_gltf(g, container), container == GltfContainer::json ? "gltf" : "glb");
    ASSERT_NE(read.scene, nullptr);
    EXPECT_EQ(read.faces(), static_cast<unsigned>(g.face_count()));
    double area = 0;
    for (unsigned m = 0; m < read.scene->mNumMeshes; ++m) {
      const aiMesh& part = *read.scene->mMeshes[m];
      ASSERT_TRUE(part.HasNormals());
      ASSERT_TRUE(part.HasTextureCoords(0));
      area += area_of(part);
      for (unsigned v = 0; v < part.mNumVertices; ++v) EXPECT_NEAR(part.mNormals[v].Length(), 1, 1e-5);
    }
    EXPECT_NEAR(area, area_of(g), 1e-5);
    aiColor4D color;
    bool violet = false;
    for (unsigned m = 0; m < read.scene->mNumMaterials; ++m) {
      if (read.scene->mMaterials[m]->Get(AI_MATKEY_COLOR_DIFFUSE, color) == aiReturn_SUCCESS) violet |= std::abs(color.r - 0.2140) < 1e-3 && std::abs(color.g - 0.0509) < 1e-3 && std::abs(color.b - 1) < 1e-6;
    }
    EXPECT_TRUE(violet) << "the card's sRGB colour as linear factor";
  }
}

TEST(ExportGltf, keeps_the_rules_of_the_format) {
  const std::string glb = format_gltf(sample(), GltfContainer::binary);
  ASSERT_EQ(glb.substr(0, 4), "glTF");
  std::uint32_t words[5];
  std::memcpy(words, glb.data(), sizeof words);
  EXPECT_EQ(words[1], 2u);
  EXPECT_EQ(words[2], glb.size());
  EXPECT_EQ(words[3] % 4, 0u);
  const auto json = nlohmann::json::parse(glb.substr(20, words[3]));
  std::uint32_t chunk = 0;
  std::memcpy(&chunk, glb.data() + 20 + words[3], 4);
  EXPECT_EQ(chunk % 4, 0u);
  const auto& views = json["bufferViews"];
  EXPECT_LE(json["buffers"][0]["byteLength"].get<std::size_t>(), chunk);
  std::size_t end = 0;
  for (const auto& view : views) {
    EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0u);
    EXPECT_EQ(view["byteOffset"].get<std::size_t>(), end) << "no holes, no overlaps";
    end += view["byteLength"].get<std::size_t>();
  }
  EXPECT_EQ(end, json["buffers"][0]["byteLength"].get<std::size_t>());
  const std::map<std::string, std::size_t> components{{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}};
  for (const auto& accessor : json["accessors"]) {
    const auto& view = views[accessor["bufferView"].get<std::size_t>()];
    EXPECT_EQ(accessor["count"].get<std::size_t>() * components.at(accessor["type"]) * 4, view["byteLength"].get<std::size_t>());
  }
  const char* binary = glb.data() + 28 + words[3];
  for (const auto& part : json["meshes"]) {
    for (const auto& primitive : part["primitives"]) {
      const auto& position = json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
      ASSERT_TRUE(position.contains("min") && position.contains("max"));
      const auto& indices = json["accessors"][primitive["indices"].get<std::size_t>()];
      const auto* index = binary + views[indices["bufferView"].get<std::size_t>()]["byteOffset"].get<std::size_t>();
      for (std::size_t i = 0; i < indices["count"]; ++i) {
        std::uint32_t v = 0;
        std::memcpy(&v, index + 4 * i, 4);
        ASSERT_LT(v, position["count"].get<std::size_t>());
      }
      EXPECT_LT(primitive["material"].get<std::size_t>(), json["materials"].size());
    }
  }
  EXPECT_EQ(json["nodes"].size(), 2u);
  EXPECT_EQ(json["materials"].size(), 2u);
}

/// The start tags of an XML text in order, closing ones with a slash before; fails on anything unbalanced.
std::vector<std::string> tags(const std::string& xml) {
  std::vector<std::string> result, open;
  for (std::size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at)) {
    const std::size_t end = xml.find('>', at);
    const std::string tag = xml.substr(at + 1, end - at - 1);
    at = end;
    if (tag[0] == '?') continue;
    if (tag[0] == '/') {
      EXPECT_FALSE(open.empty());
      EXPECT_EQ(open.back(), tag.substr(1));
      open.pop_back();
      continue;
    }
    result.push_back(tag);
    if (tag.back() != '/') open.push_back(tag.substr(0, tag.find(' ')));
    if (tag.starts_with("AppendedData")) {
      at = xml.rfind("</AppendedData>");
      open.pop_back();
      at += 10;
    }
  }
  EXPECT_TRUE(open.empty());
  return result;
}

std::string attribute(const std::string& tag, const std::string& name) {
  const std::size_t at = tag.find(' ' + name + "=\"");
  if (at == std::string::npos) return "";
  const std::size_t begin = at + name.size() + 3;
  return tag.substr(begin, tag.find('"', begin) - begin);
}

TEST(ExportVtp, raw_arrays_hold_every_column) {
  const auto g = sample();
  const std::string vtp = format_vtp(g, VtpEncoding::raw);
  const std::size_t base = vtp.find("<AppendedData encoding=\"raw\">\n_") + std::strlen("<AppendedData encoding=\"raw\">\n_");
  std::map<std::string, std::size_t> bytes_of;
  std::size_t next = 0;
  bool cells = false;
  for (const std::string& tag : tags(vtp)) {
    if (tag.starts_with("CellData")) cells = true;
    if (tag.starts_with("Points")) cells = false;
    if (!tag.starts_with("DataArray")) continue;
    EXPECT_EQ(attribute(tag, "format"), "appended");
    const std::size_t offset = std::stoul(attribute(tag, "offset"));
    EXPECT_EQ(offset, next);
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, vtp.data() + base + offset, 8);
    bytes_of[(cells ? "cell." : "") + attribute(tag, "Name")] = bytes;
    next = offset + 8 + bytes;
  }
  const auto nv = static_cast<std::size_t>(g.vertex_count()), nf = static_cast<std::size_t>(g.face_count());
  const std::map<std::string, std::size_t> expected{{"u", 8 * nv}, {"v", 8 * nv}, {"panel", 4 * nv}, {"particle", 4 * nv}, {"tag", 4 * nv}, {"cell.panel", 4 * nf}, {"cell.laminate", 4 * nf},
                                                    {"cell.strain_warp", 8 * nf}, {"Points", 24 * nv}, {"connectivity", 12 * nf}, {"offsets", 4 * nf}};
  EXPECT_EQ(bytes_of, expected);
  EXPECT_EQ(vtp.substr(base + next), "\n  </AppendedData>\n</VTKFile>\n");
}

TEST(ExportVtp, ascii_numbers_are_exact) {
  auto g = sample();
  g.x(3, 1) = 0.1 + 0.2;
  const std::string vtp = format_vtp(g, VtpEncoding::ascii);
  tags(vtp);
  EXPECT_NE(vtp.find("0.30000000000000004"), std::string::npos);
  EXPECT_EQ(vtp.find("Appended"), std::string::npos);
}

TEST(Export, supports_too) {
  const auto ball = shapes::sphere({0, 1, 0}, 0.3, 3);
  const Read obj(format_obj(ball), "obj");
  EXPECT_EQ(obj.faces(), 512u);
  const Read glb(format_gltf(ball, GltfContainer::binary), "glb");
  EXPECT_EQ(glb.faces(), 512u);
  tags(format_vtp(ball, VtpEncoding::raw));
}

}  // namespace
}  // namespace toile::io
