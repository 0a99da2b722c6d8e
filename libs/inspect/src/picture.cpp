#include "toile/inspect/picture.h"

#include "render.h"
#include "toile/base/text.h"
#include "toile/inspect/color_map.h"
#include "toile/inspect/measures.h"
#include "toile/inspect/strain.h"
#include "toile/mesh/topology.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

namespace toile::inspect {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double degree = std::numbers::pi / 180;

Vector3f linear(const Srgb& c) {
  return {static_cast<float>(linear_from_srgb(c[0])), static_cast<float>(linear_from_srgb(c[1])), static_cast<float>(linear_from_srgb(c[2]))};
}

/// Angle-weighted normals: independent of how a flat region is cut into triangles.
mesh::Points3 vertex_normals(const mesh::Points3& x, const mesh::Triangles& faces) {
  mesh::Points3 n = mesh::Points3::Zero(x.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d p = x.row(faces(f, k)), d = x.row(faces(f, (k + 1) % 3)).transpose() - p, e = x.row(faces(f, (k + 2) % 3)).transpose() - p;
      const Vector3d c = d.cross(e);
      const double size = c.norm();
      if (size > 0) n.row(faces(f, k)) += std::atan2(size, d.dot(e)) / size * c.transpose();
    }
  }
  for (Eigen::Index v = 0; v < n.rows(); ++v) {
    const double size = n.row(v).norm();
    n.row(v) = size > 0 ? Vector3d(n.row(v) / size) : Vector3d(0, 1, 0);
  }
  return n;
}

/// Seam sides keep part of their own normal: the shading shows a soft crease.
mesh::Points3 cloth_normals(const mesh::GarmentMesh& g, const mesh::Points3& x) {
  const mesh::Points3 own = vertex_normals(x, g.faces);
  if (g.welds.empty()) return own;
  const mesh::Ids particle = mesh::particles(g);
  mesh::Points3 sum = mesh::Points3::Zero(particle.maxCoeff() + 1, 3);
  for (Eigen::Index v = 0; v < x.rows(); ++v) sum.row(particle[v]) += own.row(v);
  mesh::Points3 n = own;
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    const Vector3d s = sum.row(particle[v]);
    const Vector3d joined = 0.35 * own.row(v).transpose() + 0.65 * (s.norm() > 1e-9 ? Vector3d(s.normalized()) : Vector3d(own.row(v)));
    if (joined.norm() > 1e-9) n.row(v) = joined.normalized();
  }
  return n;
}

/// Line flags of every face edge (edge k lies opposite vertex k).
std::vector<std::array<EdgeLine, 3>> edge_lines(const mesh::GarmentMesh& g, Lines lines) {
  std::vector<std::array<EdgeLine, 3>> flags(static_cast<std::size_t>(g.face_count()), {EdgeLine::none, EdgeLine::none, EdgeLine::none});
  if (lines == Lines::none) return flags;
  std::vector<std::vector<int>> seams(static_cast<std::size_t>(g.vertex_count()));
  for (const mesh::Weld& w : g.welds) {
    seams[static_cast<std::size_t>(w.a)].push_back(w.seam);
    seams[static_cast<std::size_t>(w.b)].push_back(w.seam);
  }
  std::set<std::pair<int, int>> folded;
  for (const mesh::Hinge& hinge : g.hinges) {
    // Of a fold whose line is known only the line is drawn, not the band of a roll.
    if (hinge.fold >= 0 && g.folds[static_cast<std::size_t>(hinge.fold)].runs.empty()) folded.insert(std::minmax(hinge.v0, hinge.v1));
  }
  for (const mesh::Fold& fold : g.folds) {
    for (const int run : fold.runs) {
      const std::vector<int> row = mesh::run_vertex_ids(g, run);
      for (std::size_t k = 1; k < row.size(); ++k) folded.insert(std::minmax(row[k - 1], row[k]));
    }
  }
  for (const mesh::Edge& edge : mesh::edges(g.faces)) {
    EdgeLine line = folded.count({edge.a, edge.b}) ? EdgeLine::fold : lines == Lines::mesh ? EdgeLine::mesh : EdgeLine::none;
    if (edge.faces.size() == 1) {
      const auto &a = seams[static_cast<std::size_t>(edge.a)], &b = seams[static_cast<std::size_t>(edge.b)];
      const bool sewn = std::any_of(a.begin(), a.end(), [&](int s) { return std::find(b.begin(), b.end(), s) != b.end(); });
      line = sewn ? EdgeLine::seam : EdgeLine::border;
    }
    for (const int f : edge.faces) {
      for (int k = 0; k < 3; ++k) {
        if (g.faces(f, k) != edge.a && g.faces(f, k) != edge.b) flags[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)] = line;
      }
    }
  }
  return flags;
}

/// Faces in a few kinds, each with a name and a colour.
struct Categories {
  std::vector<int> of_face;
  std::vector<std::pair<std::string, Srgb>> list;
};

Categories categories(const std::string& color, const mesh::GarmentMesh& g) {
  Categories result;
  if (color == "order") {
    std::map<int, int> place;
    for (const mesh::Panel& panel : g.panels) place[panel.order] = 0;
    const double steps = std::max<double>(1, static_cast<double>(place.size()) - 1);
    // The outermost first, as a legend is read; it is the lightest.
    for (auto it = place.rbegin(); it != place.rend(); ++it) {
      it->second = static_cast<int>(result.list.size());
      result.list.emplace_back(fmt::format("order {}", it->first), sequential_color(0.15 + 0.6 * it->second / steps));
    }
    for (Eigen::Index f = 0; f < g.face_count(); ++f) result.of_face.push_back(place[g.panels[static_cast<std::size_t>(g.face_panel[f])].order]);
    return result;
  }
  if (color == "laminate") {
    for (const mesh::Laminate& laminate : g.laminates) result.list.emplace_back(laminate.name, category_color(laminate.id));
    const int none = static_cast<int>(result.list.size());
    if (g.face_laminate.size() > 0 && g.face_laminate.minCoeff() < 0) result.list.emplace_back("no fabric", fabric::Card{}.color);
    for (Eigen::Index f = 0; f < g.face_count(); ++f) result.of_face.push_back(g.face_laminate[f] >= 0 ? g.face_laminate[f] : none);
    return result;
  }
  for (const mesh::Panel& panel : g.panels) result.list.emplace_back(panel.name, category_color(panel.id));
  for (Eigen::Index f = 0; f < g.face_count(); ++f) result.of_face.push_back(g.face_panel[f]);
  return result;
}

Categories regions(const mesh::SupportMesh& support) {
  Categories result;
  for (const std::string& name : support.region_names) result.list.emplace_back(name, category_color(static_cast<int>(result.list.size())));
  const int none = static_cast<int>(result.list.size());
  if (support.face_region.size() > 0 && support.face_region.minCoeff() < 0) result.list.emplace_back("no region", fabric::Card{}.color);
  for (const int region : support.face_region) result.of_face.push_back(region >= 0 ? region : none);
  return result;
}

/// Buttons, hooks, snaps and teeth as small balls on the cloth's face; those of open fasteners are lighter. Where the halves of a closed one
/// lie on each other it is drawn once, at the half that lies on top.
/// shown  which vertices' halves are drawn
std::vector<Surface> fastener_balls(const mesh::GarmentMesh& g, const mesh::Points3& x, const std::function<bool(int)>& shown) {
  // An octahedron whose faces are cut into four, twice.
  std::vector<Vector3d> corners{Vector3d::UnitX(), -Vector3d::UnitX(), Vector3d::UnitY(), -Vector3d::UnitY(), Vector3d::UnitZ(), -Vector3d::UnitZ()};
  std::vector<std::array<int, 3>> faces{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int round = 0; round < 2; ++round) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [found, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<int>(corners.size()));
      if (fresh) corners.push_back((corners[static_cast<std::size_t>(a)] + corners[static_cast<std::size_t>(b)]).normalized());
      return found->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  const double extent = (x.colwise().maxCoeff() - x.colwise().minCoeff()).norm();
  std::vector<Surface> balls(2);
  balls[0].colors = {linear({0.16, 0.13, 0.11})};
  balls[1].colors = {linear({0.62, 0.55, 0.45})};
  for (const mesh::Fastener& fastener : g.fasteners) {
    const double radius = std::min(fastener.kind == mesh::Fastener::Kind::zip ? 0.002 : 0.007, 0.02 * extent);
    Surface& surface = balls[fastener.closed ? 0 : 1];
    surface.kind = Surface::Kind::support;
    const bool together = fastener.closed && (x.row(fastener.a) - x.row(fastener.b)).norm() < std::max(fastener.length, radius) + 2e-3;
    for (const int v : {fastener.a, fastener.b}) {
      if (!shown(v) || (together && v == fastener.a)) continue;
      const int base = static_cast<int>(surface.x.size());
      const Vector3d centre = x.row(v);
      for (const Vector3d& corner : corners) {
        surface.x.push_back((centre + radius * corner).cast<float>());
        surface.normals.push_back(corner.cast<float>());
      }
      for (const auto& [a, b, c] : faces) surface.faces.push_back({base + a, base + b, base + c});
    }
  }
  std::erase_if(balls, [](const Surface& surface) { return surface.faces.empty(); });
  return balls;
}

/// Values at vertices: averages over the faces of the same panel (vertices are never shared between panels).
std::vector<double> averaged_to_vertices(const mesh::GarmentMesh& g, const std::vector<double>& of_faces) {
  const Eigen::VectorXd areas = mesh::rest_areas(g);
  std::vector<double> sum(static_cast<std::size_t>(g.vertex_count()), 0), weight = sum;
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(g.faces(f, k));
      sum[v] += areas[f] * of_faces[static_cast<std::size_t>(f)];
      weight[v] += areas[f];
    }
  }
  for (std::size_t v = 0; v < sum.size(); ++v) sum[v] = weight[v] > 0 ? sum[v] / weight[v] : 0;
  return sum;
}

/// The next number of the series 1, 2, 2.5, 5, 10 … that is not smaller.
double rounded_up(double value) {
  if (!(value > 0)) return 1;
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0}) {
    if (value <= step * power * (1 + 1e-9)) return step * power;
  }
  return 10 * power;
}

std::array<double, 2> scale_of(const ColorField& field, const std::optional<std::array<double, 2>>& range) {
  if (range) return *range;
  std::vector<double> v;
  v.reserve(field.values.size());
  for (const double value : field.values) v.push_back(field.diverging ? std::abs(value) : value);
  if (v.empty()) return {0, 1};
  std::sort(v.begin(), v.end());
  // Half a percent of the values may lie beyond the end of the scale, so that single faces do not rob it of contrast.
  const double high = v[static_cast<std::size_t>(0.995 * static_cast<double>(v.size() - 1))];
  if (field.diverging) return {-rounded_up(high), rounded_up(high)};
  const double low = v[static_cast<std::size_t>(0.005 * static_cast<double>(v.size() - 1))];
  if (low >= 0 && low < 0.5 * high) return {0, rounded_up(high)};
  const double step = rounded_up(0.05 * (high - low));
  return {std::floor(low / step) * step, std::ceil(high / step) * step + (high > low ? 0 : step)};
}

Srgb field_color(const ColorField& field, const std::array<double, 2>& scale, double value) {
  const double t = (value - scale[0]) / (scale[1] - scale[0]);
  return field.diverging ? diverging_color(2 * t - 1) : sequential_color(t);
}

std::string number_label(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find('.') != std::string::npos) {
    while (text.back() == '0') text.pop_back();
    if (text.back() == '.') text.pop_back();
  }
  return text == "-0" ? "0" : text;
}

void draw_legend(Image& image, const ColorField& field, const std::array<double, 2>& scale, const Srgb& background) {
  const double unit = std::min(image.width, image.height) / 900.0;
  const int bar_width = static_cast<int>(22 * unit), bar_height = static_cast<int>(0.42 * image.height);
  const int x0 = image.width - static_cast<int>(96 * unit), y0 = static_cast<int>(0.29 * image.height);
  const Srgb ink{0.2, 0.2, 0.22};
  const double title_height = 15 * unit;
  const double title_width = text_width(title_height, field.title);
  const double title_x = std::max(4.0, image.width - 18 * unit - title_width);
  // What lies behind the legend is faded, so that it can be read over a wide sleeve too.
  const int panel_left = std::max(0, static_cast<int>(std::min<double>(x0, title_x) - 10 * unit));
  for (int j = std::max(0, static_cast<int>(y0 - 50 * unit)); j < std::min(image.height, static_cast<int>(y0 + bar_height + 20 * unit)); ++j) {
    for (int i = panel_left; i < image.width; ++i) {
      for (int k = 0; k < 3; ++k) {
        std::uint8_t& v = image.pixel(i, j)[k];
        v = static_cast<std::uint8_t>(std::lround(0.25 * v + 0.75 * 255 * background[static_cast<std::size_t>(k)]));
      }
    }
  }
  for (int j = 0; j < bar_height; ++j) {
    const double value = scale[1] + (scale[0] - scale[1]) * (j + 0.5) / bar_height;
    fill_rectangle(image, x0, y0 + j, x0 + bar_width, y0 + j + 1, field_color(field, scale, value));
  }
  const double left = x0 - 0.5, right = x0 + bar_width + 0.5, top = y0 - 0.5, bottom = y0 + bar_height + 0.5;
  for (const auto& [ax, ay, bx, by] : {std::array{left, top, right, top}, std::array{right, top, right, bottom}, std::array{right, bottom, left, bottom}, std::array{left, bottom, left, top}}) {
    draw_stroke(image, ax, ay, bx, by, unit, ink);
  }
  const double text_height = 13 * unit;
  const int ticks = 4;
  const double step = (scale[1] - scale[0]) / ticks;
  // Decimals that show every tick exactly where the step is a round number.
  const double resolution = std::pow(10.0, std::floor(std::log10(std::abs(step)) + 1e-9) - 1);
  for (int i = 0; i <= ticks; ++i) {
    const double y = y0 + bar_height * (1 - static_cast<double>(i) / ticks);
    draw_stroke(image, right, y, right + 5 * unit, y, unit, ink);
    draw_text(image, right + 10 * unit, y + 0.5 * text_height, text_height, ink, number_label(scale[0] + i * step, resolution));
  }
  draw_text(image, title_x, y0 - 24 * unit, title_height, ink, field.title);
}

double categories_width(const Categories& kinds, double unit) {
  double width = 0;
  for (const auto& [name, color] : kinds.list) width = std::max(width, text_width(13 * unit, name));
  return width + 44 * unit;
}

/// Swatches with names at the right border, as many as have room.
void draw_categories(Image& image, const Categories& kinds) {
  const double unit = std::min(image.width, image.height) / 900.0, row = 22 * unit;
  const double x0 = std::max(4.0, image.width - 8 * unit - categories_width(kinds, unit) + 12 * unit);
  const auto count = std::min(kinds.list.size(), static_cast<std::size_t>(std::max(0.0, 0.9 * image.height / row)));
  double y = 0.5 * (image.height - row * static_cast<double>(count));
  const Srgb ink{0.2, 0.2, 0.22};
  for (std::size_t k = 0; k < count; ++k, y += row) {
    const auto& [name, color] = kinds.list[k];
    fill_rectangle(image, static_cast<int>(x0), static_cast<int>(y + 3 * unit), static_cast<int>(x0 + 16 * unit), static_cast<int>(y + 19 * unit), color);
    draw_text(image, x0 + 24 * unit, y + 17 * unit, 13 * unit, ink, name);
  }
}

struct FlatLayout {
  struct Label {
    int panel = 0;
    Vector3d at;      ///< middle of the name's upper line
    double room = 0;  ///< width that the name may take [m]
  };
  mesh::Points3 x;
  std::vector<Label> labels;
};

/// Positions for the flat view: panels as cut, in rows, none on another, and where to write their names.
FlatLayout lay_out_flat(const mesh::GarmentMesh& g, double aspect) {
  const std::size_t n = g.panels.size();
  std::vector<Vector2d> low(n, Vector2d::Constant(1e300)), high(n, Vector2d::Constant(-1e300));
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const auto p = static_cast<std::size_t>(g.vertex_panel[v]);
    low[p] = low[p].cwiseMin(g.uv.row(v).transpose());
    high[p] = high[p].cwiseMax(g.uv.row(v).transpose());
  }
  double area = 0, widest = 0, gap = 0;
  for (std::size_t p = 0; p < n; ++p) {
    if (high[p].x() < low[p].x()) continue;
    const Vector2d size = high[p] - low[p];
    area += size.prod();
    widest = std::max(widest, size.x());
    gap = std::max(gap, 0.06 * size.maxCoeff());
  }
  // The row length whose rows fill a frame of the wanted shape best.
  const auto rows_for = [&](double length, std::vector<Vector2d>& origin) {
    double px = 0, py = 0, row = 0, used = 0;
    origin.assign(n, Vector2d::Zero());
    for (std::size_t p = 0; p < n; ++p) {
      if (high[p].x() < low[p].x()) continue;
      const Vector2d size = high[p] - low[p];
      if (px > 0 && px + size.x() > length) {
        py -= row + 2 * gap;
        px = row = 0;
      }
      origin[p] = Vector2d(px, py - size.y()) - low[p];
      px += size.x() + gap;
      used = std::max(used, px - gap);
      row = std::max(row, size.y());
    }
    return std::max(used, aspect * (row - py));
  };
  std::vector<Vector2d> origin, best;
  double best_size = 1e300;
  for (int i = 0; i < 60; ++i) {
    const double size = rows_for(widest * (1 + 0.1 * i), origin);
    if (size < best_size) {
      best_size = size;
      best = origin;
    }
  }
  FlatLayout layout;
  layout.x = mesh::Points3::Zero(g.vertex_count(), 3);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) layout.x.row(v).head<2>() = g.uv.row(v) + best[static_cast<std::size_t>(g.vertex_panel[v])].transpose();
  for (std::size_t p = 0; p < n; ++p) {
    if (high[p].x() < low[p].x()) continue;
    layout.labels.push_back({static_cast<int>(p), Vector3d(0.5 * (low[p].x() + high[p].x()) + best[p].x(), low[p].y() + best[p].y() - 0.35 * gap, 0), high[p].x() - low[p].x() + 0.85 * gap});
  }
  return layout;
}

Result<std::array<int, 2>> picture_size(const std::string& text) {
  const auto parts = split(text, 'x');
  if (parts.size() == 2) {
    const auto w = parse_integer(trim(parts[0])), h = parse_integer(trim(parts[1]));
    if (w && h && *w >= 16 && *h >= 16 && *w <= 16384 && *h <= 16384) return std::array<int, 2>{static_cast<int>(*w), static_cast<int>(*h)};
  }
  return Issue{"bad_size", {.item = "size"}, fmt::format("'{}' is not a picture size", text), "write it like 900x1200, each between 16 and 16384", Category::input};
}

struct Angles {
  double azimuth, elevation;
};
Angles view_angles(View view) {
  switch (view) {
    case View::front: return {0, 5 * degree};
    case View::back: return {180 * degree, 5 * degree};
    case View::left:
    case View::side: return {90 * degree, 5 * degree};
    case View::right: return {-90 * degree, 5 * degree};
    case View::three_quarter: return {38 * degree, 12 * degree};
    case View::top: return {0, 80 * degree};
    case View::inside: return {0, 10 * degree};
    case View::flat: return {0, 0};
  }
  return {0, 0};
}

void add_surface(RenderScene& scene, Surface surface, const mesh::Points3& x, const mesh::Points3& normals) {
  surface.x.reserve(static_cast<std::size_t>(x.rows()));
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    surface.x.push_back(x.row(v).cast<float>());
    surface.normals.push_back(normals.row(v).cast<float>());
  }
  scene.surfaces.push_back(std::move(surface));
}

/// Cuts the surface along the plane through `point` and keeps what lies against `normal`.
void keep_far_half(Surface& s, const Vector3f& point, const Vector3f& normal) {
  std::vector<float> height;
  for (const Vector3f& p : s.x) height.push_back((p - point).dot(normal));
  std::map<std::pair<int, int>, int> cuts;
  const auto cut = [&](int a, int b) {
    const auto [it, inserted] = cuts.try_emplace(std::minmax(a, b), static_cast<int>(s.x.size()));
    if (inserted) {
      const auto [p, q] = std::pair(static_cast<std::size_t>(it->first.first), static_cast<std::size_t>(it->first.second));
      const float t = height[p] / (height[p] - height[q]);
      s.x.push_back((1 - t) * s.x[p] + t * s.x[q]);
      s.normals.push_back(((1 - t) * s.normals[p] + t * s.normals[q]).normalized());
      if (!s.colors_on_faces && s.colors.size() > 1) s.colors.push_back((1 - t) * s.colors[p] + t * s.colors[q]);
      s.vertex_lines.push_back(EdgeLine::none);
    }
    return it->second;
  };
  decltype(s.faces) faces;
  decltype(s.lines) lines;
  decltype(s.colors) colors;
  for (std::size_t f = 0; f < s.faces.size(); ++f) {
    std::vector<int> corner;     // of what is left of the face
    std::vector<EdgeLine> line;  // of the edge that follows each corner
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = s.faces[f][k], b = s.faces[f][(k + 1) % 3];
      const bool keep_a = height[static_cast<std::size_t>(a)] <= 0, keep_b = height[static_cast<std::size_t>(b)] <= 0;
      const EdgeLine along = s.lines[f][(k + 2) % 3];
      if (keep_a) {
        corner.push_back(a);
        line.push_back(along);
      }
      if (keep_a != keep_b) {
        corner.push_back(cut(a, b));
        line.push_back(keep_a ? EdgeLine::none : along);
      }
    }
    for (std::size_t k = 1; k + 1 < corner.size(); ++k) {
      faces.push_back({corner[0], corner[k], corner[k + 1]});
      lines.push_back({line[k], k + 2 == corner.size() ? line[k + 1] : EdgeLine::none, k == 1 ? line[0] : EdgeLine::none});
      if (s.colors_on_faces) colors.push_back(s.colors[f]);
    }
  }
  s.faces = std::move(faces);
  s.lines = std::move(lines);
  if (s.colors_on_faces) s.colors = std::move(colors);
}

}  // namespace

bool pictures_available() { return render_available(); }

Result<ColorField> color_field(const std::string& name, const mesh::GarmentMesh& g, const mesh::SupportMesh* support) {
  const auto faces = [](std::string title, const Eigen::VectorXd& values, double factor) {
    ColorField field{std::move(title), ColorField::Place::faces, {}, true};
    for (const double v : values) field.values.push_back(factor * v);
    return field;
  };
  if (name == "strain_warp") return faces("warp strain [%]", face_strain(g).warp, 100);
  if (name == "strain_weft") return faces("weft strain [%]", face_strain(g).weft, 100);
  if (name == "strain_bias") return faces("bias strain [%]", face_strain(g).bias, 100);
  if (name == "shear") return faces("shear angle [\xC2\xB0]", face_strain(g).shear, 1 / degree);
  if (name == "tension_warp") return faces("warp tension [N/m]", face_tension(g, face_strain(g)).warp, 1);
  if (name == "tension_weft") return faces("weft tension [N/m]", face_tension(g, face_strain(g)).weft, 1);
  if (name == "ease" && support != nullptr) {
    ColorField field{"ease [mm]", ColorField::Place::vertices, {}, false};
    for (const double e : signed_distances(g.x, *support)) field.values.push_back(1e3 * e);
    // Cloth inside the body has to catch the eye.
    field.diverging = std::any_of(field.values.begin(), field.values.end(), [](double e) { return e < 0; });
    return field;
  }
  // Columns of known meaning in units that people read.
  static const std::map<std::string, std::pair<std::string, double>> titles{
      {"edge_strain", {"largest edge strain [%]", 100}}, {"seam_gap", {"seam gap [mm]", 1e3}}, {"warp_angle", {"warp off its direction [\xC2\xB0]", 1 / degree}}, {"ease", {"ease [mm]", 1e3}}};
  const auto column = [&](const mesh::Column& c, ColorField::Place place) {
    const auto known = titles.find(name);
    ColorField field{known != titles.end() ? known->second.first : name, place, {}, false};
    const double factor = known != titles.end() ? known->second.second : 1;
    for (std::size_t i = 0; i < c.size(); ++i) field.values.push_back(factor * (c.integer ? c.integers[i] : c.reals[i]));
    field.diverging = std::any_of(field.values.begin(), field.values.end(), [](double v) { return v < 0; });
    return field;
  };
  if (const auto it = g.face_columns.find(name); it != g.face_columns.end()) return column(it->second, ColorField::Place::faces);
  if (const auto it = g.vertex_columns.find(name); it != g.vertex_columns.end()) return column(it->second, ColorField::Place::vertices);
  if (name == "ease") return Issue{"needs_support", {.item = "color"}, "ease is the distance to a support, and none is given", "add --support FILE", Category::input};
  std::vector<std::string> known{"plain", "panel", "laminate", "order", "strain_warp", "strain_weft", "strain_bias", "shear", "tension_warp", "tension_weft", "ease", "region"};
  for (const auto& [key, c] : g.face_columns) known.push_back(key);
  for (const auto& [key, c] : g.vertex_columns) known.push_back(key);
  return Issue{"unknown_color", {.item = "color"}, fmt::format("the garment has nothing called '{}' to show as colour", name), suggestion(name, known), Category::input};
}

Result<Image> draw_picture(const PictureParams& params, const mesh::GarmentMesh* garment, const mesh::SupportMesh* support) {
  TOILE_CHECK(garment != nullptr || support != nullptr, "neither a garment nor a support is given");
  if (!render_available()) {
    return Issue{"not_built", {}, "this build cannot draw pictures: Embree 3 was not there when it was configured", "install libembree-dev, configure and build again", Category::input};
  }
  auto size = picture_size(params.size);
  if (!size) return size.issues();
  const bool flat = params.view == View::flat, inside = params.view == View::inside;
  if (flat && garment == nullptr) return Issue{"bad_view", {.item = "view"}, "the flat view shows panels, and no garment is given", "choose another view", Category::input};
  const mesh::SupportMesh* measured_from = support;  // ease needs it even where it is not drawn
  if (flat || inside || (params.show == Show::garment && garment != nullptr)) support = nullptr;
  if (params.show == Show::support && support != nullptr) garment = nullptr;
  if (params.color == "region" && support == nullptr) return Issue{"needs_support", {.item = "color"}, "regions are those of a support, and none is drawn", "give a support, in a view that shows it", Category::input};

  RenderScene scene;
  scene.width = (*size)[0];
  scene.height = (*size)[1];
  scene.samples = params.samples;
  scene.background = linear(params.background);
  Angles angles = view_angles(params.view);
  if (params.azimuth) angles.azimuth = *params.azimuth;
  if (params.elevation) angles.elevation = *params.elevation;
  const Vector3d toward(std::sin(angles.azimuth) * std::cos(angles.elevation), std::sin(angles.elevation), std::cos(angles.azimuth) * std::cos(angles.elevation));
  const Vector3d right(std::cos(angles.azimuth), 0, -std::sin(angles.azimuth));
  const Vector3d up = toward.cross(right);

  std::optional<ColorField> field;
  std::optional<Categories> kinds;
  std::array<double, 2> scale{0, 1};
  mesh::Points3 cloth_x;
  std::vector<FlatLayout::Label> labels;
  if (garment != nullptr && garment->face_count() > 0) {
    const mesh::GarmentMesh& g = *garment;
    cloth_x = g.x;
    if (flat) {
      FlatLayout layout = lay_out_flat(g, static_cast<double>(scene.width) / scene.height);
      cloth_x = std::move(layout.x);
      labels = std::move(layout.labels);
    }
    Surface surface;
    surface.kind = Surface::Kind::cloth;
    const auto lines = edge_lines(g, params.lines);
    if (params.color == "panel" || params.color == "laminate" || params.color == "order") {
      kinds = categories(params.color, g);
      surface.colors_on_faces = true;
      for (const int kind : kinds->of_face) surface.colors.push_back(linear(kinds->list[static_cast<std::size_t>(kind)].second));
    } else if (params.color != "plain" && params.color != "region") {
      auto found = color_field(params.color, g, measured_from);
      if (!found) return found.issues();
      field = std::move(*found);
      if (field->place == ColorField::Place::faces && params.smoothing == Smoothing::vertices) {
        field->values = averaged_to_vertices(g, field->values);
        field->place = ColorField::Place::vertices;
      }
      scale = scale_of(*field, params.range);
      if (!(scale[0] != scale[1])) return Issue{"bad_range", {.item = "range"}, "the two ends of the colour scale are equal", "give two different values", Category::input};
      surface.data_colors = true;
      for (const double v : field->values) surface.colors.push_back(linear(field_color(*field, scale, v)));
      surface.colors_on_faces = field->place == ColorField::Place::faces;
    } else {
      surface.colors_on_faces = true;
      std::vector<Vector3f> palette;
      for (const auto& laminate : g.laminates) palette.push_back(linear(laminate.equivalent.color));
      const Vector3f unknown = linear(fabric::Card{}.color);
      for (Eigen::Index f = 0; f < g.face_count(); ++f) {
        surface.colors.push_back(g.face_laminate[f] >= 0 ? palette[static_cast<std::size_t>(g.face_laminate[f])] : unknown);
      }
    }
    surface.vertex_lines.assign(static_cast<std::size_t>(g.vertex_count()), EdgeLine::none);
    for (Eigen::Index f = 0; f < g.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const EdgeLine line = lines[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)];
        if (line != EdgeLine::seam && line != EdgeLine::border) continue;
        for (const int end : {g.faces(f, (k + 1) % 3), g.faces(f, (k + 2) % 3)}) {
          EdgeLine& at = surface.vertex_lines[static_cast<std::size_t>(end)];
          at = std::max(at, line);
        }
      }
    }
    const Vector3d centre = 0.5 * (cloth_x.colwise().minCoeff() + cloth_x.colwise().maxCoeff()).transpose();
    for (Eigen::Index f = 0; f < g.face_count(); ++f) surface.faces.push_back({g.faces(f, 0), g.faces(f, 1), g.faces(f, 2)});
    surface.lines = lines;
    add_surface(scene, std::move(surface), cloth_x, cloth_normals(g, cloth_x));
    // Depth along the level direction of view: the near half is left out.
    const Vector3d level(toward.x(), 0, toward.z());
    if (inside) keep_far_half(scene.surfaces.back(), centre.cast<float>(), level.cast<float>());
    const auto shown = [&](int v) { return !inside || (cloth_x.row(v).transpose() - centre).dot(level) <= 0; };
    for (Surface& balls : fastener_balls(g, cloth_x, shown)) scene.surfaces.push_back(std::move(balls));
  }
  if (support != nullptr) {
    Surface surface;
    surface.kind = Surface::Kind::support;
    surface.colors = {linear(params.support_color)};
    if (params.color == "region") {
      kinds = regions(*support);
      surface.colors_on_faces = true;
      surface.colors.clear();
      for (const int kind : kinds->of_face) surface.colors.push_back(linear(kinds->list[static_cast<std::size_t>(kind)].second));
    }
    for (Eigen::Index f = 0; f < support->faces.rows(); ++f) surface.faces.push_back({support->faces(f, 0), support->faces(f, 1), support->faces(f, 2)});
    if (params.lines == Lines::mesh) surface.lines.assign(surface.faces.size(), {EdgeLine::mesh, EdgeLine::mesh, EdgeLine::mesh});
    add_surface(scene, std::move(surface), support->x, vertex_normals(support->x, support->faces));
  }

  // The camera: a long lens; the picture is shifted and scaled to hold what it is fitted to.
  std::vector<Vector3d> fitted;
  const auto add = [&](const mesh::Points3& x) {
    for (Eigen::Index v = 0; v < x.rows(); ++v) fitted.push_back(x.row(v));
  };
  const bool has_cloth = cloth_x.rows() > 0;
  if (has_cloth && (params.frame != Frame::support || support == nullptr)) add(cloth_x);
  if (support != nullptr && (params.frame != Frame::garment || !has_cloth)) add(support->x);
  if (fitted.empty()) return Issue{"nothing_to_draw", {}, "the files hold no surface", "give a garment or a support with faces", Category::input};
  Vector3d low = fitted.front(), high = fitted.front();
  for (const Vector3d& p : fitted) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  Camera& camera = scene.camera;
  const double extent = std::max((high - low).norm(), 1e-6);
  camera.target = 0.5 * (low + high);
  camera.toward = toward;
  camera.right = right;
  camera.up = up;
  camera.distance = 7 * extent;
  Vector2d plane_low = Vector2d::Constant(1e300), plane_high = Vector2d::Constant(-1e300);
  for (const Vector3d& p : fitted) {
    const Vector2d q = camera.project(p);
    plane_low = plane_low.cwiseMin(q);
    plane_high = plane_high.cwiseMax(q);
  }
  const double margin = 0.045 * std::min(scene.width, scene.height);
  // Names of panels stand under the panels of the flat view.
  const bool named = kinds && (params.color != "panel" || !flat);
  const double unit = std::min(scene.width, scene.height) / 900.0;
  const double legend = field ? 0.11 * std::min(scene.width, scene.height) : named ? std::min(categories_width(*kinds, unit), 0.4 * scene.width) : 0;
  const Vector2d free(scene.width - 2 * margin - legend, scene.height - 2 * margin);
  const Vector2d span = (plane_high - plane_low).cwiseMax(1e-9);
  camera.metres_per_pixel = std::max(span.x() / free.x(), span.y() / free.y()) / params.zoom;
  const Vector2d middle = 0.5 * (plane_low + plane_high);
  camera.corner = middle + camera.metres_per_pixel * Vector2d(-(margin + 0.5 * free.x()), margin + 0.5 * free.y());

  if (!flat) {
    double floor = low.y();
    for (const Surface& surface : scene.surfaces) {
      for (const Vector3f& p : surface.x) floor = std::min(floor, static_cast<double>(p.y()));
    }
    scene.ground = floor - 1e-4 * extent;
  }
  scene.extent = extent;

  auto image = render(scene);
  if (!image) return image;
  for (const FlatLayout::Label& label : labels) {
    const Vector2d q = (camera.project(label.at) - camera.corner) / camera.metres_per_pixel;
    const std::string& name = garment->panels[static_cast<std::size_t>(label.panel)].name;
    // Long names under narrow panels are written smaller, so that neighbours stay apart.
    const double full = 0.014 * std::min(scene.width, scene.height);
    const double height = std::clamp(full * label.room / camera.metres_per_pixel / std::max(text_width(full, name), 1e-9), 0.6 * full, full);
    draw_text(*image, q.x() - 0.5 * text_width(height, name), -q.y() + full, height, {0.25, 0.25, 0.28}, name);
  }
  if (named) draw_categories(*image, *kinds);
  if (field) draw_legend(*image, *field, scale, params.background);
  return image;
}

}  // namespace toile::inspect
