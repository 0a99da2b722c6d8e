#include "render.h"

#include "toile/base/parallel.h"
#include "toile/inspect/color_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#if TOILE_HAS_EMBREE
#include <embree3/rtcore.h>
#include <tbb/task_arena.h>
#endif

namespace toile::inspect {

#if !TOILE_HAS_EMBREE

bool render_available() { return false; }
Result<Image> render(const RenderScene&) { return Issue{"not_built", {}, "this build has no Embree", "install libembree-dev, configure and build again"}; }

#else

bool render_available() { return true; }

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float pi = std::numbers::pi_v<float>;
constexpr int packet = 8;      // shadow rays of one sample
constexpr int key_rays = 2;    // of them towards the key light
constexpr int sky_rays = packet - key_rays;

struct Device {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = nullptr;
  Device() = default;
  Device(const Device&) = delete;
  ~Device() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

/// A different sequence for each (pixel, purpose), the same on every run.
struct Dice {
  std::uint32_t state;
  Dice(std::uint32_t pixel, std::uint32_t purpose) : state(mix(pixel * 0x9E3779B1u + mix(purpose + 0x7F4A7C15u))) {}
  static std::uint32_t mix(std::uint32_t h) {
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
  }
  float next() {
    state = mix(state + 0x9E3779B9u);
    return static_cast<float>(state >> 8) * 0x1.0p-24f;
  }
};

float fraction(float v) { return v - std::floor(v); }

struct Frame3 {
  Vector3f t, b, n;
  explicit Frame3(const Vector3f& normal) : n(normal) {
    const Vector3f helper = std::abs(n.x()) < 0.8f ? Vector3f(1, 0, 0) : Vector3f(0, 1, 0);
    t = n.cross(helper).normalized();
    b = n.cross(t);
  }
  Vector3f to_world(float x, float y, float z) const { return x * t + y * b + z * n; }
};

enum class Kind : unsigned char { empty, ground, support, cloth };

struct Sample {
  Vector3f albedo{0, 0, 0}, light{1, 1, 1}, glow{0, 0, 0}, normal{0, 0, 1};  ///< colour = albedo * light + glow
  float depth = 0;
  Kind kind = Kind::empty;
  bool data = false;
};

struct Pixel {
  Vector3f color{0, 0, 0}, albedo{0, 0, 0}, light{0, 0, 0}, glow{0, 0, 0}, normal{0, 0, 1};
  float depth = 0;
  Kind kind = Kind::empty;
  bool mixed = false, data = false;
};

Vector3f shoulder(Vector3f c) {
  for (int k = 0; k < 3; ++k) {
    if (c[k] > 0.7f) c[k] = 0.7f + 0.3f * (1 - std::exp(-(c[k] - 0.7f) / 0.3f));
  }
  return c;
}

Vector3f lit(Kind kind, bool data, const Vector3f& albedo, const Vector3f& light, const Vector3f& glow) {
  if (kind == Kind::empty || kind == Kind::ground) return albedo.cwiseProduct(light);
  if (data) {
    const float gray = (light.x() + light.y() + light.z()) / 3 / 0.95f;
    return albedo * (0.42f + 0.58f * std::min(gray, 1.0f));
  }
  return shoulder(albedo.cwiseProduct(light) + glow);
}

class Tracer {
 public:
  Tracer(const RenderScene& scene, RTCScene embree) : scene_(scene), embree_(embree) {
    toward_ = scene.camera.toward.cast<float>();
    origin_ = (scene.camera.distance * scene.camera.toward).cast<float>();
    // The key light stands high on the viewer's left whatever the view.
    const Vector3f level = Vector3f(toward_.x(), 0, toward_.z()).norm() > 0.05f ? Vector3f(toward_.x(), 0, toward_.z()).normalized() : Vector3f(0, 0, 1);
    const Vector3f right = scene.camera.right.cast<float>();
    key_ = (0.50f * level - 0.72f * right + Vector3f(0, 0.72f, 0)).normalized();
    low_ = Vector3f::Constant(1e30f);
    high_ = -low_;
    for (const Surface& surface : scene.surfaces) {
      for (const Vector3f& p : surface.x) {
        low_ = low_.cwiseMin(local(p));
        high_ = high_.cwiseMax(local(p));
      }
    }
    epsilon_ = static_cast<float>(2e-5 * scene.extent);
    line_unit_ = std::max(0.6f, static_cast<float>(std::min(scene.width, scene.height)) / 900.0f);
  }

  /// Rays of one pixel, strata numbered from 0 to count.
  Pixel pixel(int px, int py, int count, std::uint32_t purpose) const {
    const auto id = static_cast<std::uint32_t>(py * scene_.width + px);
    Dice dice(id, purpose);
    const Strata strata{dice.next(), dice.next(), dice.next(), dice.next(), count};
    const float shift_x = dice.next(), shift_y = dice.next();
    Pixel sum;
    Sample first;
    for (int i = 0; i < count; ++i) {
      // A lattice in the pixel: each sample has its own column and row.
      const float sx = fraction((static_cast<float>(i) + shift_x) / static_cast<float>(count));
      const float sy = fraction(static_cast<float>(i) * 0.61803399f + shift_y);
      const Sample s = trace(static_cast<float>(px) + sx, static_cast<float>(py) + sy, i, strata);
      if (i == 0) {
        first = s;
        sum.normal = s.normal;
        sum.depth = s.depth;
        sum.kind = s.kind;
        sum.data = s.data;
      } else if (s.kind != first.kind || s.normal.dot(first.normal) < 0.9f || (s.albedo - first.albedo).cwiseAbs().maxCoeff() > 0.03f ||
                 std::abs(s.depth - first.depth) > 12 * static_cast<float>(scene_.camera.metres_per_pixel)) {
        sum.mixed = true;
      }
      sum.color += lit(s.kind, s.data, s.albedo, s.light, s.glow);
      sum.albedo += s.albedo;
      sum.light += s.light;
      sum.glow += s.glow;
    }
    const float k = 1 / static_cast<float>(count);
    sum.color *= k;
    sum.albedo *= k;
    sum.light *= k;
    sum.glow *= k;
    return sum;
  }

 private:
  struct Strata {
    float a, b, c, d;
    int count;
  };

  Vector3f local(const Vector3f& p) const { return p - scene_.camera.target.cast<float>(); }

  /// What comes from the surroundings: a bright ceiling, a wall behind the camera, a floor that gives some back.
  Vector3f surroundings(const Vector3f& d) const {
    const float sky = 0.32f + 0.40f * std::clamp(0.5f + 0.7f * d.y(), 0.0f, 1.0f);
    const float wall = 0.14f * std::max(0.0f, d.dot(toward_));
    const float value = d.y() > 0 ? sky + wall : std::max(0.27f, sky) * 0.92f + 0.7f * wall;
    return value * Vector3f(0.975f, 0.99f, 1.0f);
  }

  Sample trace(float px, float py, int index, const Strata& strata) const {
    const auto& camera = scene_.camera;
    const float scale = static_cast<float>(camera.metres_per_pixel);
    const Vector3f on_plane = (static_cast<float>(camera.corner.x()) + scale * px) * camera.right.cast<float>() +
                              (static_cast<float>(camera.corner.y()) - scale * py) * camera.up.cast<float>();
    const Vector3f d = (on_plane - origin_).normalized();

    alignas(16) RTCRayHit hit;
    // Starting near the scene keeps the precision of single numbers.
    const float start = std::max(0.0f, static_cast<float>(camera.distance) - 2 * static_cast<float>(scene_.extent) - (high_ - low_).norm());
    const Vector3f o = origin_ + start * d;
    hit.ray = {o.x(), o.y(), o.z(), 0, d.x(), d.y(), d.z(), 0, 1e30f, 0xffffffffu, 0, 0};
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect1(embree_, &context, &hit);

    Sample s;
    float ground_t = -1;
    if (scene_.ground && d.y() < -1e-4f) ground_t = (static_cast<float>(*scene_.ground - camera.target.y()) - o.y()) / d.y();
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID || (ground_t > 0 && ground_t < hit.ray.tfar)) {
      s.albedo = scene_.background;
      if (ground_t <= 0) return s;
      const Vector3f p = o + ground_t * d;
      // Beyond the reach of shadows the floor needs no rays.
      const float reach = 0.9f * (high_.y() - low_.y()) + 0.3f * (high_ - low_).norm();
      if (p.x() < low_.x() - reach || p.x() > high_.x() + reach || p.z() < low_.z() - reach || p.z() > high_.z() + reach) return s;
      s.kind = Kind::ground;
      s.depth = start + ground_t;
      s.normal = Vector3f(0, 1, 0);
      const float border = std::min({p.x() - low_.x() + reach, high_.x() + reach - p.x(), p.z() - low_.z() + reach, high_.z() + reach - p.z()}) / reach;
      const float fade = std::clamp(2.5f * border, 0.0f, 1.0f);
      const Vector3f ratio = light(p + Vector3f(0, epsilon_, 0), s.normal, Vector3f::Zero(), index, strata, true);
      s.light = Vector3f::Ones() - 0.8f * fade * (Vector3f::Ones() - ratio);
      return s;
    }

    const Surface& surface = scene_.surfaces[hit.hit.geomID];
    const auto& face = surface.faces[hit.hit.primID];
    const Vector3f v[3] = {local(surface.x[static_cast<std::size_t>(face[0])]), local(surface.x[static_cast<std::size_t>(face[1])]), local(surface.x[static_cast<std::size_t>(face[2])])};
    const Vector3f n[3] = {surface.normals[static_cast<std::size_t>(face[0])], surface.normals[static_cast<std::size_t>(face[1])], surface.normals[static_cast<std::size_t>(face[2])]};
    const float w[3] = {1 - hit.hit.u - hit.hit.v, hit.hit.u, hit.hit.v};
    const Vector3f cross = (v[1] - v[0]).cross(v[2] - v[0]);
    const float double_area = cross.norm();
    const bool back = cross.dot(d) > 0;
    const float side = back ? -1.0f : 1.0f;
    const Vector3f flat = double_area > 0 ? Vector3f(side / double_area * cross) : Vector3f(-d);
    Vector3f normal = side * (w[0] * n[0] + w[1] * n[1] + w[2] * n[2]);
    normal = normal.norm() > 1e-6f ? normal.normalized() : flat;
    if (normal.dot(flat) < 0.1f) normal = flat;  // a fold sharper than the mesh
    const float facing = -normal.dot(d);
    if (facing < 0.02f) normal = (normal - (facing - 0.02f) * d * -1.0f).normalized();

    s.kind = surface.kind == Surface::Kind::cloth ? Kind::cloth : Kind::support;
    s.data = surface.data_colors;
    s.depth = start + hit.ray.tfar;
    s.normal = normal;
    if (surface.colors.size() == 1) s.albedo = surface.colors[0];
    else if (surface.colors_on_faces) s.albedo = surface.colors[hit.hit.primID];
    else s.albedo = w[0] * surface.colors[static_cast<std::size_t>(face[0])] + w[1] * surface.colors[static_cast<std::size_t>(face[1])] + w[2] * surface.colors[static_cast<std::size_t>(face[2])];
    if (back && s.kind == Kind::cloth && !s.data) s.albedo *= 0.72f;
    if (!surface.lines.empty()) s.albedo *= line_factor(surface, hit.hit.primID, v, w, double_area, scale);

    const Vector3f p = w[0] * v[0] + w[1] * v[1] + w[2] * v[2];
    // Start of the shadow rays lifted onto the smooth surface that the normals stand for, so that the facets do not
    // shade themselves (docs/bibliography.md#hanika2021).
    Vector3f lifted = Vector3f::Zero();
    for (int k = 0; k < 3; ++k) {
      const float depth = std::min(0.0f, (p - v[k]).dot(side * n[k]));
      lifted -= w[k] * depth * side * n[k];
    }
    s.light = light(p + lifted + epsilon_ * flat, normal, s.albedo, index, strata, false);
    if (s.kind == Kind::cloth && !s.data) {
      // Fibre ends that stand up catch light at grazing angles.
      const float graze = 1 - std::clamp(-normal.dot(d), 0.0f, 1.0f);
      s.glow = 0.10f * graze * graze * graze * s.light.cwiseProduct(Vector3f::Constant(0.3f) + 0.7f * s.albedo);
    }
    return s;
  }

  float line_factor(const Surface& surface, unsigned face, const Vector3f* v, const float* w, float double_area, float scale) const {
    const float to_pixels = 1 / (scale * line_unit_);
    float factor = 1;
    const auto draw = [&](EdgeLine line, float distance) {
      const float half_width = line == EdgeLine::border ? 1.7f : line == EdgeLine::fold ? 1.2f : line == EdgeLine::seam ? 0.85f : 0.45f;
      const float depth = line == EdgeLine::border ? 0.55f : line == EdgeLine::fold ? 0.5f : line == EdgeLine::seam ? 0.45f : 0.30f;
      if (distance * to_pixels < half_width) factor = std::min(factor, 1 - depth);
    };
    const Vector3f p = w[0] * v[0] + w[1] * v[1] + w[2] * v[2];
    for (int k = 0; k < 3; ++k) {
      const auto corner = static_cast<std::size_t>(k);
      // Faces that only touch a line with a corner share its width there.
      if (!surface.vertex_lines.empty()) {
        const EdgeLine line = surface.vertex_lines[static_cast<std::size_t>(surface.faces[face][corner])];
        if (line != EdgeLine::none) draw(line, (p - v[k]).norm());
      }
      const EdgeLine line = surface.lines[face][corner];
      if (line == EdgeLine::none) continue;
      if (line == EdgeLine::fold && std::abs(w[(k + 1) % 3] - w[(k + 2) % 3]) > 0.5f) continue;
      const float length = (v[(k + 2) % 3] - v[(k + 1) % 3]).norm();
      if (length > 0) draw(line, w[k] * double_area / length);
    }
    return factor;
  }

  /// Light that reaches p per unit of albedo. For the floor: the ratio to what would come without the things on it.
  Vector3f light(const Vector3f& p, const Vector3f& n, const Vector3f& albedo, int index, const Strata& strata, bool as_ratio) const {
    alignas(32) RTCRay8 rays;
    alignas(32) int valid[packet];
    const Frame3 around_key(key_), around_n(n);
    Vector3f direction[packet];
    for (int k = 0; k < packet; ++k) {
      valid[k] = -1;
      if (k < key_rays) {
        const auto i = static_cast<float>(index * key_rays + k);
        const float r = 0.11f * std::sqrt(fraction((i + strata.a) / static_cast<float>(strata.count * key_rays)));
        const float angle = 2 * pi * fraction(i * 0.61803399f + strata.b);
        direction[k] = around_key.to_world(r * std::cos(angle), r * std::sin(angle), 1).normalized();
        if (direction[k].dot(n) <= 0) valid[k] = 0;
      } else {
        const auto i = static_cast<float>(index * sky_rays + k - key_rays);
        const float u = fraction((i + strata.c) / static_cast<float>(strata.count * sky_rays));
        const float angle = 2 * pi * fraction(i * 0.61803399f + strata.d);
        const float r = std::sqrt(u);
        direction[k] = around_n.to_world(r * std::cos(angle), r * std::sin(angle), std::sqrt(std::max(0.0f, 1 - u)));
      }
      rays.org_x[k] = p.x();
      rays.org_y[k] = p.y();
      rays.org_z[k] = p.z();
      rays.dir_x[k] = direction[k].x();
      rays.dir_y[k] = direction[k].y();
      rays.dir_z[k] = direction[k].z();
      rays.tnear[k] = 0;
      rays.tfar[k] = 1e30f;
      rays.time[k] = 0;
      rays.mask[k] = 0xffffffffu;
      rays.id[k] = 0;
      rays.flags[k] = 0;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded8(valid, embree_, &context, &rays);
    const Vector3f key_color(0.72f, 0.707f, 0.685f);
    Vector3f seen = Vector3f::Zero(), open = Vector3f::Zero();
    for (int k = 0; k < packet; ++k) {
      const bool free = rays.tfar[k] > 0;
      if (k < key_rays) {
        if (valid[k] == 0) continue;
        const Vector3f c = std::max(0.0f, direction[k].dot(n)) / key_rays * key_color;
        open += c;
        if (free) seen += c;
      } else {
        const Vector3f c = surroundings(direction[k]) / sky_rays;
        open += c;
        // What hides the sky is lit itself and gives back some of it.
        seen += free ? c : Vector3f(0.30f * c.cwiseProduct(as_ratio ? Vector3f::Constant(0.5f) : albedo));
      }
    }
    if (as_ratio) return seen.cwiseQuotient(open);
    return seen;
  }

  const RenderScene& scene_;
  RTCScene embree_;
  Vector3f toward_, origin_, key_, low_, high_;
  float epsilon_ = 0, line_unit_ = 1;
};

/// Smooths what is left of the sampling noise in the light (not in the colours), within smooth parts of one surface.
std::vector<Vector3f> smoothed_light(const std::vector<Pixel>& pixels, int width, int height, int step, float metres_per_pixel) {
  std::vector<Vector3f> result(pixels.size());
  parallel_for(static_cast<std::size_t>(height), 4, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < width; ++x) {
      const Pixel& p = pixels[row * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
      Vector3f& out = result[row * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
      out = p.light;
      if (p.kind == Kind::empty || p.mixed) continue;
      Vector3f sum = p.light;
      float weights = 1;
      for (int j = -2; j <= 2; ++j) {
        for (int i = -2; i <= 2; ++i) {
          const int qx = x + i * step, qy = y + j * step;
          if ((i == 0 && j == 0) || qx < 0 || qy < 0 || qx >= width || qy >= height) continue;
          const Pixel& q = pixels[static_cast<std::size_t>(qy) * static_cast<std::size_t>(width) + static_cast<std::size_t>(qx)];
          if (q.kind != p.kind || q.mixed) continue;
          const float turn = q.normal.dot(p.normal);
          if (turn < 0.8f) continue;
          const float away = std::abs(q.depth - p.depth) / (metres_per_pixel * static_cast<float>(step));
          if (p.kind != Kind::ground && away > 10) continue;
          const float apart = (q.light - p.light).squaredNorm();
          const float t2 = turn * turn, t8 = t2 * t2 * t2 * t2;
          const float weight = t8 * t8 * std::exp(-0.18f * static_cast<float>(i * i + j * j) - 12 * apart);
          sum += weight * q.light;
          weights += weight;
        }
      }
      out = sum / weights;
    }
  });
  return result;
}

}  // namespace

Result<Image> render(const RenderScene& scene) {
  Device embree;
  if (embree.device == nullptr) return Issue{"no_device", {}, "Embree does not start on this machine", "a processor with SSE2 is needed"};
  embree.scene = rtcNewScene(embree.device);
  rtcSetSceneFlags(embree.scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(embree.scene, RTC_BUILD_QUALITY_HIGH);
  const Vector3f target = scene.camera.target.cast<float>();
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    const Surface& surface = scene.surfaces[i];
    RTCGeometry geometry = rtcNewGeometry(embree.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* x = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), surface.x.size()));
    auto* f = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), std::max<std::size_t>(1, surface.faces.size())));
    if (x == nullptr || f == nullptr) {
      rtcReleaseGeometry(geometry);
      return Issue{"out_of_memory", {}, "there is not enough memory for the picture's scene", "draw a smaller garment"};
    }
    for (std::size_t v = 0; v < surface.x.size(); ++v) {
      for (int k = 0; k < 3; ++k) x[3 * v + static_cast<std::size_t>(k)] = surface.x[v][k] - target[k];
    }
    if (surface.faces.empty()) f[0] = f[1] = f[2] = 0;
    for (std::size_t t = 0; t < surface.faces.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) f[3 * t + k] = static_cast<unsigned>(surface.faces[t][k]);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(embree.scene, geometry, static_cast<unsigned>(i));
    rtcReleaseGeometry(geometry);
  }
  // Built by one thread: the tree, and with it the winner among equal hits, does not depend on the number of threads.
  tbb::task_arena(1).execute([&] { rtcCommitScene(embree.scene); });

  const Tracer tracer(scene, embree.scene);
  const auto width = static_cast<std::size_t>(scene.width), height = static_cast<std::size_t>(scene.height);
  std::vector<Pixel> pixels(width * height);
  parallel_for(height, 2, [&](std::size_t y) {
    for (std::size_t x = 0; x < width; ++x) pixels[y * width + x] = tracer.pixel(static_cast<int>(x), static_cast<int>(y), scene.samples, 1);
  });
  // Outlines and lines need more rays than surfaces do.
  std::vector<char> again(width * height, 0);
  parallel_for(height, 8, [&](std::size_t y) {
    for (std::size_t x = 0; x < width; ++x) {
      const Pixel& p = pixels[y * width + x];
      const auto differs = [&](const Pixel& q) {
        return q.mixed || q.kind != p.kind || q.normal.dot(p.normal) < 0.85f || (q.albedo - p.albedo).cwiseAbs().maxCoeff() > 0.08f;
      };
      again[y * width + x] = p.mixed || (x > 0 && differs(pixels[y * width + x - 1])) || (x + 1 < width && differs(pixels[y * width + x + 1])) ||
                             (y > 0 && differs(pixels[(y - 1) * width + x])) || (y + 1 < height && differs(pixels[(y + 1) * width + x]));
    }
  });
  parallel_for(height, 2, [&](std::size_t y) {
    for (std::size_t x = 0; x < width; ++x) {
      if (!again[y * width + x]) continue;
      const Pixel more = tracer.pixel(static_cast<int>(x), static_cast<int>(y), 3 * scene.samples, 2);
      Pixel& p = pixels[y * width + x];
      p.color = 0.25f * p.color + 0.75f * more.color;
      p.albedo = 0.25f * p.albedo + 0.75f * more.albedo;
      p.light = 0.25f * p.light + 0.75f * more.light;
      p.glow = 0.25f * p.glow + 0.75f * more.glow;
      p.mixed = p.mixed || more.mixed;
    }
  });
  for (const int step : {1, 2}) {
    const auto smooth = smoothed_light(pixels, scene.width, scene.height, step, static_cast<float>(scene.camera.metres_per_pixel));
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i].light = smooth[i];
  }
  Image image(scene.width, scene.height);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Pixel& p = pixels[i];
    const Vector3f color = p.mixed ? p.color : lit(p.kind, p.data, p.albedo, p.light, p.glow);
    for (std::size_t k = 0; k < 3; ++k) {
      image.rgb[3 * i + k] = static_cast<std::uint8_t>(std::lround(255 * srgb_from_linear(std::clamp(static_cast<double>(color[static_cast<int>(k)]), 0.0, 1.0))));
    }
  }
  return image;
}

#endif

}  // namespace toile::inspect
