#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "export_common.h"
#include "toile/io/export.h"

static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian; bytes would have to be swapped");

namespace toile::io {
namespace {

using Json = nlohmann::ordered_json;

enum : int { array_buffer = 34962, element_array_buffer = 34963, type_float = 5126, type_uint = 5125 };

std::string base64(const std::string& bytes) {
  static constexpr char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= n ? letters[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

double linear_from_srgb(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }

class Writer {
 public:
  Json document{{"asset", {{"version", "2.0"}, {"generator", "toile-export"}}}, {"scene", 0}, {"scenes", Json::array({{{"nodes", Json::array()}}})}};

  template <class T>
  int accessor(const std::vector<T>& values, int components, int component_type, int target, const char* type, Json extra) {
    const std::size_t offset = buffer_.size();
    buffer_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", values.size() * sizeof(T)}});
    if (target != 0) document["bufferViews"].back()["target"] = target;
    Json item{{"bufferView", document["bufferViews"].size() - 1}, {"componentType", component_type}, {"count", values.size() / static_cast<std::size_t>(components)}, {"type", type}};
    for (auto& [key, value] : extra.items()) item[key] = value;
    document["accessors"].push_back(std::move(item));
    return static_cast<int>(document["accessors"].size()) - 1;
  }

  int material(const std::string& name, const std::array<double, 3>& srgb) {
    Json factor = Json::array();
    for (const double v : srgb) factor.push_back(linear_from_srgb(v));
    factor.push_back(1.0);
    document["materials"].push_back({{"name", name}, {"pbrMetallicRoughness", {{"baseColorFactor", factor}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.9}}}, {"doubleSided", true}});
    return static_cast<int>(document["materials"].size()) - 1;
  }

  /// A mesh of one node: attributes shared by a primitive for each material.
  void node(const std::string& name, const mesh::Points3& x, const mesh::Points3& normals, const mesh::Points2* uv, const std::map<int, std::vector<std::array<int, 3>>>& faces_of_material,
            const FrameSequence* frames = nullptr) {
    // Only the points that this node uses, renumbered in their order.
    std::vector<int> used;
    for (const auto& [material, faces] : faces_of_material) {
      for (const auto& face : faces) used.insert(used.end(), face.begin(), face.end());
    }
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    if (used.empty()) return;
    std::vector<float> position, normal, texture;
    Json low = Json::array(), high = Json::array();
    for (int k = 0; k < 3; ++k) {
      float least = INFINITY, most = -INFINITY;
      for (const int v : used) {
        least = std::min(least, static_cast<float>(x(v, k)));
        most = std::max(most, static_cast<float>(x(v, k)));
      }
      low.push_back(least);
      high.push_back(most);
    }
    for (const int v : used) {
      Eigen::Vector3f n = normals.row(v).cast<float>();
      n.normalize();
      for (int k = 0; k < 3; ++k) {
        position.push_back(static_cast<float>(x(v, k)));
        normal.push_back(n[k]);
      }
      if (uv != nullptr) {
        texture.push_back(static_cast<float>((*uv)(v, 0)));
        texture.push_back(static_cast<float>(1 - (*uv)(v, 1)));
      }
    }
    Json attributes{{"POSITION", accessor(position, 3, type_float, array_buffer, "VEC3", {{"min", low}, {"max", high}})}, {"NORMAL", accessor(normal, 3, type_float, array_buffer, "VEC3", Json::object())}};
    if (uv != nullptr) attributes["TEXCOORD_0"] = accessor(texture, 2, type_float, array_buffer, "VEC2", Json::object());
    // A target a frame: how far each point is from where it rests. All primitives share them.
    Json targets = Json::array();
    if (frames != nullptr) {
      for (const mesh::Points3& at : frames->points) {
        std::vector<float> shift;
        std::array<float, 3> least, most;
        least.fill(INFINITY), most.fill(-INFINITY);
        for (const int v : used) {
          for (int k = 0; k < 3; ++k) {
            const auto s = static_cast<float>(at(v, k) - static_cast<double>(static_cast<float>(x(v, k))));
            shift.push_back(s);
            least[static_cast<std::size_t>(k)] = std::min(least[static_cast<std::size_t>(k)], s);
            most[static_cast<std::size_t>(k)] = std::max(most[static_cast<std::size_t>(k)], s);
          }
        }
        targets.push_back({{"POSITION", accessor(shift, 3, type_float, array_buffer, "VEC3", {{"min", least}, {"max", most}})}});
      }
    }
    Json primitives = Json::array();
    for (const auto& [material, faces] : faces_of_material) {
      std::vector<std::uint32_t> indices;
      for (const auto& face : faces) {
        for (const int v : face) indices.push_back(static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin()));
      }
      primitives.push_back({{"attributes", attributes}, {"indices", accessor(indices, 1, type_uint, element_array_buffer, "SCALAR", Json::object())}, {"material", material}});
      if (!targets.empty()) primitives.back()["targets"] = targets;
    }
    document["meshes"].push_back({{"name", name}, {"primitives", std::move(primitives)}});
    document["nodes"].push_back({{"name", name}, {"mesh", document["meshes"].size() - 1}});
    document["scenes"][0]["nodes"].push_back(document["nodes"].size() - 1);
    if (!targets.empty()) {
      document["meshes"].back()["weights"] = std::vector<float>(targets.size(), 0.0f);
      animated_.push_back(static_cast<int>(document["nodes"].size()) - 1);
    }
  }

  /// One animation of all nodes with targets: at each frame's time its own target counts, straight in between.
  void animate(const FrameSequence& frames) {
    if (animated_.empty() || frames.times.empty()) return;
    std::vector<float> times, weights;
    for (std::size_t k = 0; k < frames.times.size(); ++k) {
      times.push_back(static_cast<float>(frames.times[k]));
      for (std::size_t j = 0; j < frames.times.size(); ++j) weights.push_back(j == k ? 1.0f : 0.0f);
    }
    const int input = accessor(times, 1, type_float, 0, "SCALAR", {{"min", Json::array({times.front()})}, {"max", Json::array({times.back()})}});
    const int output = accessor(weights, 1, type_float, 0, "SCALAR", Json::object());
    Json channels = Json::array();
    for (const int node : animated_) channels.push_back({{"sampler", 0}, {"target", {{"node", node}, {"path", "weights"}}}});
    document["animations"] = Json::array({{{"name", "simulation"}, {"samplers", Json::array({{{"input", input}, {"output", output}, {"interpolation", "LINEAR"}}})}, {"channels", std::move(channels)}}});
  }

  std::string finish(GltfContainer container) {
    if (document["scenes"][0]["nodes"].empty()) document["scenes"][0].erase("nodes");
    const bool has_buffer = !buffer_.empty();
    if (container == GltfContainer::json) {
      if (has_buffer) document["buffers"] = Json::array({{{"byteLength", buffer_.size()}, {"uri", "data:application/octet-stream;base64," + base64(buffer_)}}});
      return document.dump(1) + '\n';
    }
    if (has_buffer) document["buffers"] = Json::array({{{"byteLength", buffer_.size()}}});
    std::string json = document.dump();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    buffer_.resize((buffer_.size() + 3) / 4 * 4, '\0');
    std::string out = "glTF";
    const auto number = [&](std::size_t value) {
      const auto word = static_cast<std::uint32_t>(value);
      out.append(reinterpret_cast<const char*>(&word), 4);
    };
    number(2);
    number(12 + 8 + json.size() + (has_buffer ? 8 + buffer_.size() : 0));
    number(json.size());
    out += "JSON" + json;
    if (has_buffer) {
      number(buffer_.size());
      out += std::string("BIN\0", 4) + buffer_;
    }
    return out;
  }

 private:
  std::vector<int> animated_;  // nodes
  std::string buffer_;
};

void add_support(Writer& writer, const mesh::SupportMesh& s, const FrameSequence* frames) {
  const int material = writer.material("body", {0.77, 0.71, 0.65});
  std::map<int, std::vector<std::array<int, 3>>> faces;
  for (Eigen::Index f = 0; f < s.faces.rows(); ++f) faces[material].push_back({s.faces(f, 0), s.faces(f, 1), s.faces(f, 2)});
  writer.node("body", s.x, export_normals(s.x, s.faces), nullptr, faces, frames);
}

}  // namespace

std::string format_gltf(const mesh::GarmentMesh& g, GltfContainer container) { return format_gltf(g, nullptr, {}, container); }

std::string format_gltf(const mesh::GarmentMesh& g, const mesh::SupportMesh* support, const Animation& animation, GltfContainer container) {
  const auto fits = [](const FrameSequence* frames, const mesh::Points3& x) { return frames == nullptr || frames->points.empty() || frames->points.front().rows() == x.rows(); };
  TOILE_CHECK(fits(animation.garment, g.x) && (support == nullptr || fits(animation.support, support->x)), "frames of another mesh");
  Writer writer;
  std::map<int, int> material_of;  // laminate -> material
  for (Eigen::Index f = 0; f < g.face_count(); ++f) material_of.emplace(g.face_laminate[f], 0);
  for (auto& [laminate, material] : material_of) {
    if (laminate < 0) material = writer.material("cloth", fabric::Card{}.color);
    else material = writer.material(g.laminates[static_cast<std::size_t>(laminate)].name, g.laminates[static_cast<std::size_t>(laminate)].equivalent.color);
  }
  const mesh::Points3 normals = export_normals(g.x, g.faces);
  std::vector<std::map<int, std::vector<std::array<int, 3>>>> faces(g.panels.size());
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    faces[static_cast<std::size_t>(g.face_panel[f])][material_of.at(g.face_laminate[f])].push_back({g.faces(f, 0), g.faces(f, 1), g.faces(f, 2)});
  }
  for (const mesh::Panel& panel : g.panels) writer.node(panel.name, g.x, normals, &g.uv, faces[static_cast<std::size_t>(panel.id)], animation.garment);
  if (support != nullptr) add_support(writer, *support, animation.support);
  if (animation.garment != nullptr) writer.animate(*animation.garment);
  return writer.finish(container);
}

std::string format_gltf(const mesh::SupportMesh& s, GltfContainer container) {
  Writer writer;
  add_support(writer, s, nullptr);
  return writer.finish(container);
}

}  // namespace toile::io
