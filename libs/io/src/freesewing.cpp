#include "draft.h"

namespace toile::io {
namespace {

constexpr double no_length = 1e-3;  // shorter segments are left out [mm]

/// Reads the JSON; anything of another shape than expected throws, with the place in words.
class DraftReader {
 public:
  static Draft read(const ordered_json& root) {
    Draft draft;
    need(root.is_object() && root.contains("parts") && root["parts"].is_object(), "the file", "an object with 'parts'");
    draft.design = root.value("design", "");
    draft.origin = "FreeSewing " + draft.design;
    if (root.contains("version") && root["version"].is_string())
      draft.origin += " " + root["version"].get<std::string>();
    const std::string units = root.value("units", "mm");
    need(units == "mm", "units", "mm");
    for (const auto& [name, part] : root["parts"].items()) {
      draft.parts.push_back(read_part(name, part));
      if (root.contains("cutlist") && root["cutlist"].is_object() && root["cutlist"].contains(name))
        read_cuts(root["cutlist"][name], draft.parts.back());
    }
    return draft;
  }

 private:
  static Point2 point(const ordered_json& j, const std::string& where) {
    if (j.is_object()) {
      need(j.contains("x") && j.contains("y") && j["x"].is_number() && j["y"].is_number(), where, "a position");
      return {j["x"].get<double>(), j["y"].get<double>()};
    }
    need(j.is_array() && j.size() == 2 && j[0].is_number() && j[1].is_number(), where, "a position [x, y]");
    return {j[0].get<double>(), j[1].get<double>()};
  }

  static DraftPart read_part(const std::string& name, const ordered_json& j) {
    DraftPart part;
    part.name = name;
    need(j.is_object() && j.contains("points") && j["points"].is_object() && j.contains("paths") &&
             j["paths"].is_object(),
         name, "an object with points and paths");
    for (const auto& [id, p] : j["points"].items()) part.points.emplace_back(id, point(p, name + "." + id));
    for (const auto& [id, path] : j["paths"].items()) {
      part.paths.emplace_back(id, read_path(path, name + "." + id));
      if (!path.value("hidden", false)) part.drawn.push_back(id);
    }
    for (const char* key : {"notches", "buttons"}) {
      if (!j.contains(key)) continue;
      need(j[key].is_array(), name + "." + key, "a list");
      for (const auto& snippet : j[key]) {
        need(snippet.is_object() && snippet.contains("at"), name + "." + key, "objects with 'at'");
        const Point2 at = point(snippet["at"], name + "." + key);
        if (key[0] == 'n')
          part.notches.push_back(at);
        else
          part.buttons.emplace_back(snippet.value("def", "button"), at);
      }
    }
    if (j.contains("grainline") && j["grainline"].is_array() && j["grainline"].size() == 2) {
      part.grain = {point(j["grainline"][0], name + ".grainline"), point(j["grainline"][1], name + ".grainline")};
    }
    return part;
  }

  static DraftPath read_path(const ordered_json& j, const std::string& where) {
    DraftPath path;
    need(j.is_object() && j.contains("segments") && j["segments"].is_array(), where,
         "an object with a list of segments");
    std::optional<Point2> start, last;
    for (const auto& s : j["segments"]) {
      need(s.is_object() && s.contains("type") && s["type"].is_string(), where, "segments with a type");
      const std::string type = s["type"];
      if (type == "move") {
        start = last = point(s.at("to"), where);
        path.strokes.emplace_back();
        continue;
      }
      if (type != "line" && type != "cubic" && type != "close") continue;  // noop and the like draw nothing
      need(last.has_value(), where, "a move before any other segment");
      const Point2 to = type == "close" ? *start : point(s.at("to"), where);
      Segment segment = pattern::line_segment(*last, to);
      if (type == "cubic")
        segment = pattern::cubic_segment(*last, point(s.at("cp1"), where), point(s.at("cp2"), where), to);
      const double size = (to - *last).norm() +
                          (type == "cubic" ? (segment.control_1 - *last).norm() + (segment.control_2 - to).norm() : 0);
      if (size > no_length) path.strokes.back().push_back(segment);
      last = to;
    }
    std::erase_if(path.strokes, [](const auto& stroke) { return stroke.empty(); });
    return path;
  }

  static void read_cuts(const ordered_json& j, DraftPart& part) {
    if (!j.is_object()) return;
    if (j.contains("cutOnFold") && j["cutOnFold"].is_array() && j["cutOnFold"].size() == 2) {
      part.fold = {point(j["cutOnFold"][0], part.name + " fold"), point(j["cutOnFold"][1], part.name + " fold")};
    }
    part.grain_is_fold = j.contains("grainOrigin") && j["grainOrigin"] == "cutonfold";
    if (!j.contains("materials") || !j["materials"].is_object()) return;
    for (const auto& [material, list] : j["materials"].items()) {
      need(list.is_array(), part.name + " cut list", "a list for each material");
      for (const auto& cut : list) {
        part.cuts.push_back({material, cut.value("cut", 1), cut.value("identical", false), cut.value("onFold", false)});
      }
    }
  }
};

}  // namespace

Draft read_freesewing(const ordered_json& root) {
  return DraftReader::read(root);
}

}  // namespace toile::io
