#include <algorithm>

#include "ply_format.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"
#include "toile/io/record_yaml.h"

namespace toile::io {
namespace {

constexpr const char* support_magic = "toile-support 1";

struct Header {
  std::vector<std::string> regions;
  std::map<std::string, std::array<double, 3>> landmarks;
  std::map<std::string, double> girths;
  std::vector<mesh::RouteEntry> route;
  static void describe(auto& f) {
    f(&Header::regions, {.key = "regions", .doc = "region names, in order of their index"});
    f(&Header::landmarks, {.key = "landmarks", .doc = "named positions", .unit = "m"});
    f(&Header::girths, {.key = "girths", .doc = "measured girths", .unit = "m"});
    f(&Header::route, {.key = "route", .doc = "stages that the support went through"});
  }
};

}  // namespace

Result<mesh::SupportMesh> parse_support(std::string_view bytes, const std::string& name) {
  TOILE_TRY(const ply::Document document, ply::parse(bytes, name));
  if (std::find(document.comments.begin(), document.comments.end(), support_magic) == document.comments.end()) {
    return Issue{"not_a_support", {.file = name}, "this PLY file is not a support (no comment 'toile-support 1')", "make one with toile-form, or bring a body in with toile-body"};
  }
  Header header;
  Issues issues = read_record(ply::metadata(document), name, *record_type<Header>(), &header, Units::si);
  for (Issue& issue : issues) issue.place.line = issue.place.column = 0;
  mesh::SupportMesh support;
  support.region_names = std::move(header.regions);
  support.landmarks = std::move(header.landmarks);
  support.girths = std::move(header.girths);
  support.route = std::move(header.route);
  ply::Columns vertex(document, name, "vertex", issues);
  const auto nv = static_cast<Eigen::Index>(vertex.rows());
  support.x.resize(nv, 3);
  const char* axes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) support.x.col(k) = Eigen::Map<const Eigen::VectorXd>(vertex.reals(axes[k]).data(), nv);
  ply::Columns face(document, name, "face", issues);
  support.faces = Eigen::Map<const mesh::Triangles>(face.triples("vertex_indices").data(), static_cast<Eigen::Index>(face.rows()), 3);
  const std::vector<int> region = face.integers("region");
  support.face_region = Eigen::Map<const mesh::Ids>(region.data(), static_cast<Eigen::Index>(region.size()));
  if (issues.empty()) issues = mesh::validate(support);
  for (Issue& issue : issues) issue.place.file = name;
  if (!issues.empty()) return issues;
  return support;
}

Result<mesh::SupportMesh> read_support(const std::string& path) {
  TOILE_TRY(const std::string bytes, read_file(path));
  return parse_support(bytes, path);
}

std::string format_support(const mesh::SupportMesh& support, Encoding encoding) {
  const Header header{support.region_names, support.landmarks, support.girths, support.route};
  ply::Document document;
  document.comments.push_back(support_magic);
  ply::add_metadata(document, block_yaml_si(*record_type<Header>(), &header));
  ply::Element vertex{"vertex", static_cast<std::size_t>(support.x.rows()), {}};
  const char* axes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    const Eigen::VectorXd column = support.x.col(k);
    vertex.properties.push_back(ply::real_column(axes[k], {column.data(), column.data() + column.size()}));
  }
  document.elements.push_back(std::move(vertex));
  ply::Property corners = ply::integer_column("vertex_indices", {support.faces.data(), support.faces.data() + support.faces.size()});
  corners.list = true;
  ply::Element face{"face", static_cast<std::size_t>(support.faces.rows()), {}};
  face.properties.push_back(std::move(corners));
  face.properties.push_back(ply::integer_column("region", {support.face_region.data(), support.face_region.data() + support.face_region.size()}));
  document.elements.push_back(std::move(face));
  return ply::format(document, encoding);
}

}  // namespace toile::io
