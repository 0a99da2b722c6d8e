#include <bit>

#include "export_common.h"
#include "toile/base/text.h"
#include "toile/io/export.h"

static_assert(std::endian::native == std::endian::little, "the file says little-endian; bytes would have to be swapped");

namespace toile::io {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

class Writer {
 public:
  explicit Writer(VtpEncoding encoding) : encoding_(encoding) {}

  void open(const std::string& tag) { xml_ += indent() + '<' + tag + ">\n", ++level_; }
  void close(const std::string& tag) { --level_, xml_ += indent() + "</" + tag + ">\n"; }

  template <class T>
  void array(const std::string& name, const T* values, std::size_t count, int components = 1) {
    const char* type = std::is_same_v<T, double> ? "Float64" : "Int32";
    std::string tag = fmt::format("{}<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" ", indent(), type, escaped(name), components);
    if (encoding_ == VtpEncoding::raw) {
      xml_ += tag + fmt::format("format=\"appended\" offset=\"{}\"/>\n", appended_.size());
      const std::uint64_t bytes = count * sizeof(T);
      appended_.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
      appended_.append(reinterpret_cast<const char*>(values), bytes);
      return;
    }
    xml_ += tag + "format=\"ascii\">\n";
    for (std::size_t i = 0; i < count; ++i) {
      if constexpr (std::is_same_v<T, double>) xml_ += format_number(values[i]);
      else xml_ += fmt::format("{}", values[i]);
      xml_ += (i + 1) % 12 == 0 || i + 1 == count ? '\n' : ' ';
    }
    xml_ += indent() + "</DataArray>\n";
  }
  void array(const std::string& name, const std::vector<int>& values) { array(name, values.data(), values.size()); }
  void array(const std::string& name, const std::vector<double>& values) { array(name, values.data(), values.size()); }
  void array(const std::string& name, const mesh::Ids& values) { array(name, values.data(), static_cast<std::size_t>(values.size())); }
  void column(const std::string& name, const mesh::Column& c) {
    if (c.integer) array(name, c.integers);
    else array(name, c.reals);
  }

  void piece(std::size_t points, std::size_t faces) {
    xml_ = fmt::format("<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n");
    level_ = 1;
    open("PolyData");
    open(fmt::format("Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\"", points, faces));
  }
  void geometry(const mesh::Points3& x, const mesh::Triangles& faces) {
    open("Points");
    array("Points", x.data(), static_cast<std::size_t>(x.size()), 3);
    close("Points");
    open("Polys");
    array("connectivity", faces.data(), static_cast<std::size_t>(faces.size()));
    std::vector<int> offsets;
    for (Eigen::Index f = 0; f < faces.rows(); ++f) offsets.push_back(static_cast<int>(3 * (f + 1)));
    array("offsets", offsets);
    close("Polys");
  }
  std::string finish() {
    close("Piece");
    close("PolyData");
    if (encoding_ == VtpEncoding::raw) xml_ += "  <AppendedData encoding=\"raw\">\n_" + appended_ + "\n  </AppendedData>\n";
    return xml_ + "</VTKFile>\n";
  }

 private:
  std::string indent() const { return std::string(static_cast<std::size_t>(2 * level_), ' '); }
  VtpEncoding encoding_;
  std::string xml_, appended_;
  int level_ = 0;
};

}  // namespace

std::string format_vtp(const mesh::GarmentMesh& g, VtpEncoding encoding) {
  Writer w(encoding);
  w.piece(static_cast<std::size_t>(g.vertex_count()), static_cast<std::size_t>(g.face_count()));
  w.open("PointData");
  for (int k = 0; k < 2; ++k) {
    const Eigen::VectorXd column = g.uv.col(k);
    w.array(k == 0 ? "u" : "v", column.data(), static_cast<std::size_t>(column.size()));
  }
  w.array("panel", g.vertex_panel);
  w.array("particle", mesh::particles(g));
  for (const auto& [name, column] : g.vertex_columns) w.column(name, column);
  w.close("PointData");
  w.open("CellData");
  w.array("panel", g.face_panel);
  w.array("laminate", g.face_laminate);
  for (const auto& [name, column] : g.face_columns) w.column(name, column);
  w.close("CellData");
  w.geometry(g.x, g.faces);
  return w.finish();
}

std::string format_vtp(const mesh::SupportMesh& s, VtpEncoding encoding) {
  Writer w(encoding);
  w.piece(static_cast<std::size_t>(s.x.rows()), static_cast<std::size_t>(s.faces.rows()));
  w.open("CellData");
  w.array("region", s.face_region);
  w.close("CellData");
  w.geometry(s.x, s.faces);
  return w.finish();
}

}  // namespace toile::io
