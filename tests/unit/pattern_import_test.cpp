#include "toile/io/pattern_import.h"

#include <gtest/gtest.h>

#include "patterns.h"
#include "toile/io/file.h"
#include "toile/io/pattern_yaml.h"
#include "toile/io/record_yaml.h"

using namespace toile;
using namespace toile::pattern;
using test::with;

namespace {

/// A front on the fold and a sleeve cut twice, as the drafting script writes them.
const char* const draft = R"({
 "design": "sample", "version": "1.2.3", "units": "mm", "y": "down",
 "parts": {
  "sample.front": {
   "points": {"_help": [0,0], "top": [0,0], "anchor": [0,0], "neck": [40,-20], "side": [100,30], "hemSide": [100,200], "hem": [0,200],
              "curveMiddle": [103.75,115], "pocketLeft": [20,100], "pocketRight": [60,100], "pitch": [80,16.6667], "off": [150,100], "curveOff": [150,150], "button": [0,50]},
   "paths": {
    "seam": {"class": "fabric", "hidden": false, "segments": [
     {"type":"move","to":[0,0]}, {"type":"line","to":[40,-20]}, {"type":"line","to":[100,30]},
     {"type":"cubic","cp1":[105,80],"cp2":[105,150],"to":[100,200]}, {"type":"line","to":[0,200]}, {"type":"close"}]},
    "dart": {"class": "", "hidden": false, "segments": [
     {"type":"move","to":[50,60]}, {"type":"line","to":[55,80]}, {"type":"line","to":[50,100]}, {"type":"line","to":[45,80]}, {"type":"close"}]},
    "pocket": {"class": "help", "hidden": false, "segments": [
     {"type":"move","to":[20,150]}, {"type":"line","to":[60,150]}, {"type":"move","to":[20,170]}, {"type":"line","to":[60,170]}]},
    "open": {"class": "", "hidden": true, "segments": [{"type":"move","to":[20,100]}, {"type":"line","to":[60,100]}]}
   },
   "notches": [{"def":"notch","at":[100,30]}, {"def":"bnotch","at":[20,100]}, {"def":"notch","at":[150,100]}],
   "buttons": [{"def":"button","at":[0,50]}, {"def":"buttonhole","at":[0,50]}, {"def":"button","at":[-20,50]}],
   "grainline": null
  },
  "sample.sleeve": {
   "points": {"a": [0,0], "b": [100,0], "c": [90,80], "d": [10,80]},
   "paths": {"outline": {"class": "fabric", "hidden": false, "segments": [
     {"type":"move","to":[0,0]}, {"type":"cubic","cp1":[30,-60],"cp2":[70,-60],"to":[100,0]}, {"type":"line","to":[90,80]}, {"type":"line","to":[10,80]}, {"type":"line","to":[0,0]}, {"type":"close"}]}},
   "notches": [], "buttons": [], "grainline": [[50,10],[50,70]]
  }
 },
 "cutlist": {
  "sample.front": {"materials": {"fabric": [{"cut":1,"identical":false,"onBias":false,"onFold":true}], "lining": [{"cut":2,"identical":true}]},
   "grainOrigin": "cutonfold", "cutOnFold": [{"x":0,"y":0},{"x":0,"y":180}]},
  "sample.sleeve": {"materials": {"fabric": [{"cut":2,"identical":false}]}, "grainOrigin": "grainline"}
 }
})";

const char* const spec = R"(
pieces:
  - name: front
    part: sample.front
    fold: centre
    edges: {shoulder: neck>side, side_upper: side>curveMiddle, side_lower: curveMiddle>hemSide}
    holes: {dart: {path: dart, edges: {}}}
    lines: {pocket: {path: pocket, kind: placement}}
    rename: {hemSide: corner}
    tolerance_note: x
)";

io::ImportParams params(const std::string& yaml) {
  auto result = io::read_record<io::ImportParams>(yaml, "spec.yaml");
  if (!result) throw std::runtime_error(to_string(result.issues().front()));
  return std::move(*result);
}
const std::string good_spec = with(spec, "    tolerance_note: x\n", "");

Result<io::ImportedPattern> import(const std::string& yaml, const std::string& json = draft) {
  return io::import_pattern(json, "draft.json", params(yaml));
}

std::string sample_file(const std::string& name) {
  auto bytes = io::read_file(std::string(TOILE_SOURCE_DIR) + "/samples/" + name);
  if (!bytes) throw std::runtime_error(to_string(bytes.issues().front()));
  return *bytes;
}

std::vector<CutPanel> sample_panels(const std::string& name) {
  const auto pattern = io::parse_pattern(sample_file("patterns/" + name), name);
  if (!pattern) throw std::runtime_error(to_string(pattern.issues().front()));
  auto panels = cut_panels(*pattern);
  if (!panels) throw std::runtime_error(to_string(panels.issues().front()));
  return std::move(*panels);
}

/// Sum of the lengths of edges, in mm.
double length(const std::vector<CutPanel>& panels, const std::string& panel, const std::vector<std::string>& edges) {
  double sum = 0;
  for (const std::string& name : edges) {
    const CutPanel* p = find_panel(panels, panel);
    const PanelEdge* edge = p ? find_edge(*p, name) : nullptr;
    if (!edge) throw std::runtime_error("no edge " + panel + "." + name);
    sum += edge->curve.length() * 1e3;
  }
  return sum;
}

}  // namespace

TEST(ImportFreesewing, edges_points_fold_and_marks) {
  const auto imported = import(good_spec);
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  const Pattern& pattern = imported->pattern;
  EXPECT_EQ(pattern.name, "sample");
  EXPECT_EQ(pattern.origin, "FreeSewing sample 1.2.3");
  EXPECT_TRUE(pattern.y_down);
  ASSERT_EQ(pattern.pieces.size(), 1u);
  const Piece& front = pattern.pieces[0];
  EXPECT_EQ(front.material, "fabric");
  EXPECT_EQ(front.copies, 1);
  EXPECT_EQ(front.fold, "centre");
  EXPECT_FALSE(front.grain);
  std::vector<std::string> names;
  for (const Edge& edge : front.outline) names.push_back(edge.name);
  // Unnamed segments are called by their ends; the point with several names by the one that is no helper.
  EXPECT_EQ(names,
            (std::vector<std::string>{"top_neck", "shoulder", "side_upper", "side_lower", "corner_hem", "centre"}));
  EXPECT_TRUE(front.points.count("top"));
  EXPECT_FALSE(front.points.count("hemSide"));
  EXPECT_EQ(front.points.at("corner"), Point2(100, 200));
  ASSERT_EQ(front.holes.size(), 1u);
  EXPECT_EQ(front.holes[0].edges.size(), 4u);
  ASSERT_EQ(front.lines.size(), 2u);
  EXPECT_EQ(front.lines[1].name, "pocket_2");
  EXPECT_EQ(front.lines[1].kind, LineKind::placement);
  // The notch on the border, the one inside as a drill point; those off the cloth are told.
  ASSERT_EQ(front.notches.size(), 1u);
  EXPECT_EQ(front.notches[0].point, "side");
  ASSERT_EQ(front.marks.size(), 3u);
  EXPECT_EQ(front.marks[0].kind, MarkKind::drill);
  EXPECT_EQ(front.marks[1].kind, MarkKind::button);
  EXPECT_EQ(front.marks[2].kind, MarkKind::buttonhole);
  EXPECT_EQ(imported->notes.size(), 2u);
}

TEST(ImportFreesewing, a_run_may_split_a_curve) {
  const auto imported = import(good_spec);
  ASSERT_TRUE(imported);
  const Piece& front = imported->pattern.pieces[0];
  const Segment whole = cubic_segment({100, 30}, {105, 80}, {105, 150}, {100, 200});
  const Curve upper(front.outline[2].segments), lower(front.outline[3].segments);
  EXPECT_NEAR(upper.length() + lower.length(), Curve({whole}).length(), 1e-9);
  EXPECT_NEAR((upper.to() - position(whole, 0.5)).norm(), 0, 0.1);
  EXPECT_EQ(upper.to(), lower.from());
}

TEST(ImportFreesewing, without_a_spec_everything_comes) {
  const auto imported = import("{}");
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  ASSERT_EQ(imported->pattern.pieces.size(), 2u);
  EXPECT_EQ(imported->pattern.pieces[0].fold, "fold");
  const Piece& sleeve = imported->pattern.pieces[1];
  EXPECT_EQ(sleeve.name, "sleeve");
  EXPECT_EQ(sleeve.copies, 2);
  // The arrow was drawn down the page; the warp is taken up it.
  EXPECT_EQ(sleeve.grain->from, Point2(50, 70));
  EXPECT_EQ(sleeve.outline[0].name, "a_b");
}

TEST(ImportFreesewing, another_material_its_copies_and_shortcuts) {
  const auto imported = import(
      "pieces: [{name: lining, part: sample.front, material: lining, grain: y, shortcuts: [side>hemSide], edges: "
      "{long: side>hemSide}, splits: [{edge: long, distance: 50 mm, point: half, first: a1, second: a2}]}]");
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  const Piece& lining = imported->pattern.pieces[0];
  EXPECT_EQ(lining.copies, 2);
  EXPECT_TRUE(lining.identical);
  EXPECT_FALSE(lining.fold);
  const auto edge =
      std::find_if(lining.outline.begin(), lining.outline.end(), [](const Edge& e) { return e.name == "a1"; });
  ASSERT_NE(edge, lining.outline.end());
  EXPECT_EQ(edge->segments, std::vector<Segment>{line_segment({100, 30}, {100, 80})});
}

TEST(ImportFreesewing, points_may_be_made_of_points) {
  const auto imported = import(
      "pieces: [{name: s, part: sample.sleeve, made: {low: {from: mid, by: [10 mm, 5 mm]}, mid: {from: d, to: a, "
      "fraction: 0.5}, near: {from: b, to: c, distance: 20 mm}}, points: [mid, low, near], shortcuts: [near>mid], edges: "
      "{cut: near>mid}}]");
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  const Piece& piece = imported->pattern.pieces[0];
  EXPECT_EQ(piece.points.at("mid"), Point2(5, 40));
  EXPECT_EQ(piece.points.at("low"), Point2(15, 35));  // up the page is against y
  const Point2 near = Point2(100, 0) + 20 * Point2(-10, 80).normalized();
  EXPECT_NEAR((piece.points.at("near") - near).norm(), 0, 2e-6);
  ASSERT_EQ(piece.outline.size(), 4u);
  const auto cut =
      std::find_if(piece.outline.begin(), piece.outline.end(), [](const Edge& edge) { return edge.name == "cut"; });
  ASSERT_NE(cut, piece.outline.end());
  EXPECT_EQ(cut->segments.size(), 1u);
}

TEST(ImportFreesewing, an_outline_may_be_drawn_anew_through_points) {
  const auto imported = import(
      "pieces: [{name: s, part: sample.sleeve, made: {e: {from: b, by: [-20 mm, -100 mm]}}, path: a>b>(e)>d>a, edges: {hem: b>d}}]");
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  const Piece& piece = imported->pattern.pieces[0];
  ASSERT_EQ(piece.outline.size(), 3u);
  const auto hem = std::find_if(piece.outline.begin(), piece.outline.end(), [](const Edge& edge) { return edge.name == "hem"; });
  ASSERT_NE(hem, piece.outline.end());
  ASSERT_EQ(hem->segments.size(), 1u);
  EXPECT_EQ(hem->segments, std::vector<Segment>{pattern::quadratic_segment({100, 0}, {80, 100}, {10, 80})});
}

TEST(ImportFreesewing, lines_may_bend_and_end_where_the_cloth_does) {
  const auto imported = import(with(
      with(good_spec, "    lines:", "    made: {l: {from: top, by: [20 mm, -80 mm]}, r: {from: l, by: [60 mm, 0]}}\n    lines:"),
      "{pocket: {path: pocket, kind: placement}}",
      "{bent: {run: top>(neck)>(side)>hemSide}, through: {run: l>r}, beyond: {run: button>off, kind: stitch}}"));
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  std::map<std::string, InternalLine> lines;
  for (const InternalLine& line : imported->pattern.pieces[0].lines) lines[line.name] = line;
  ASSERT_EQ(lines.size(), 5u);  // the dart cuts two of them
  EXPECT_EQ(lines["bent"].segments, std::vector<Segment>{cubic_segment({0, 0}, {40, -20}, {100, 30}, {100, 200})});
  // The dart takes the middle of the line away.
  EXPECT_NEAR((lines["through"].segments.front().from - Point2(20, 80)).norm(), 0, 1e-9);
  EXPECT_NEAR((lines["through"].segments.back().to - Point2(45, 80)).norm(), 0, 2e-3);
  EXPECT_NEAR((lines["through_2"].segments.front().from - Point2(55, 80)).norm(), 0, 2e-3);
  EXPECT_NEAR((lines["through_2"].segments.back().to - Point2(80, 80)).norm(), 0, 1e-9);
  // The new end is on the border.
  const Point2 end = lines["beyond_2"].segments.back().to;
  const Curve border({cubic_segment({100, 30}, {105, 80}, {105, 150}, {100, 200})});
  EXPECT_NEAR(border.nearest(end).distance, 0, 2e-6);
  EXPECT_NEAR(Curve({line_segment({0, 50}, {150, 100})}).nearest(end).distance, 0, 2e-3);
  int cut = 0;
  for (const Issue& note : imported->notes) cut += note.code == "line_cut";
  EXPECT_EQ(cut, 2);
}

TEST(ImportFreesewing, allowances_of_piece_and_edges) {
  const auto imported = import(with(good_spec, "    lines:", "    allowance: 1 cm\n    allowances: {shoulder: 15 mm}\n    lines:"));
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  const Piece& front = imported->pattern.pieces[0];
  EXPECT_EQ(front.allowance, 10);
  EXPECT_EQ(front.outline[1].name, "shoulder");
  EXPECT_EQ(front.outline[1].allowance, 15);
  EXPECT_FALSE(front.outline[0].allowance);
}

TEST(ImportFreesewing, a_material_that_the_cut_list_forgets) {
  const auto imported = import("pieces: [{name: lining, part: sample.sleeve, material: lining, cut: 2}]");
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  EXPECT_EQ(imported->pattern.pieces[0].material, "lining");
  EXPECT_EQ(imported->pattern.pieces[0].copies, 2);
}

TEST(ImportFreesewing, runs_may_be_listed_against_the_outline) {
  const auto a = import(good_spec), b = import(with(good_spec, "neck>side,", "side>neck,"));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->pattern, b->pattern);
}

struct BadImport {
  const char* name;
  const char* part;
  const char* by;
  const char* code;
};
void PrintTo(const BadImport& row, std::ostream* out) {
  *out << row.name;
}
class ImportMustFail : public testing::TestWithParam<BadImport> {};

TEST_P(ImportMustFail, says_what) {
  const BadImport& row = GetParam();
  const std::string yaml = with(good_spec, row.part, row.by);
  ASSERT_FALSE(yaml.empty());
  const auto imported = import(yaml);
  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.issues().front().code, row.code) << to_string(imported.issues().front());
  EXPECT_EQ(imported.issues().front().place.file, "draft.json");
  EXPECT_FALSE(imported.issues().front().remedy.empty());
}

INSTANTIATE_TEST_SUITE_P(
    Rows, ImportMustFail,
    testing::Values(BadImport{"part", "sample.front", "sample.frant", "unknown_part"},
                    BadImport{"path", "path: dart", "path: darts", "unknown_path"},
                    BadImport{"open_path", "path: dart", "path: open", "bad_draft"},
                    BadImport{"point", "neck>side,", "nock>side,", "unknown_point"},
                    BadImport{"off_outline", "neck>side,", "neck>off,", "run_off_outline"},
                    BadImport{"one_point", "neck>side,", "neck,", "bad_run"},
                    BadImport{"order", "neck>side,", "neck>hem>side>hemSide,", "bad_run"},
                    BadImport{"overlap", "neck>side,", "neck>side>curveMiddle,", "edges_overlap"},
                    BadImport{"both_ways",
                              "{shoulder: neck>side, side_upper: side>curveMiddle, side_lower: curveMiddle>hemSide}",
                              "{x: top>side, y: side>hem, z: neck>hemSide, w: top>hemSide}", "edges_overlap"},
                    BadImport{"line_path", "path: pocket", "path: pockets", "unknown_path"},
                    BadImport{"line_run", "path: pocket", "run: (neck)>side", "bad_run"},
                    BadImport{"line_controls", "path: pocket", "run: neck>(side)>(top)>(hem)>hemSide", "bad_run"},
                    BadImport{"line_ends_with_control", "path: pocket", "run: neck>(side)", "bad_run"},
                    BadImport{"line_off_the_cloth", "path: pocket", "run: off>curveOff", "line_outside"},
                    BadImport{"made_point", "fold: centre", "made: {new: {from: tup, by: [0, 0]}}", "unknown_point"},
                    BadImport{"made_again", "fold: centre", "made: {top: {from: neck, by: [0, 0]}}", "duplicate_name"},
                    BadImport{"open_run", "fold: centre", "path: top>neck>side", "bad_run"},
                    BadImport{"made_in_a_circle", "fold: centre",
                              "made: {new: {from: neck, to: old, fraction: 0.5}, old: {from: new, by: [0, 0]}}", "bad_point"},
                    BadImport{"made_towards_itself", "fold: centre",
                              "made: {new: {from: neck, to: neck, distance: 1 mm}}", "bad_point"},
                    BadImport{"allowance", "fold: centre", "allowances: {shoulders: 1 mm}", "unknown_edge"},
                    BadImport{"fold_edge", "fold: centre",
                              "cut: 2\n    fold: centre\n    material: lining\n    grain: y", "unknown_edge"},
                    BadImport{"material", "fold: centre", "material: silk", "unknown_material"},
                    BadImport{"grain", "fold: centre", "fold: none", "grain_missing"},
                    BadImport{"grain_point", "fold: centre", "grain: top>nowhere", "unknown_point"},
                    BadImport{"rename_clash", "hemSide: corner", "hemSide: a.b", "bad_name"}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(ImportFreesewing, a_fold_without_an_edge_is_told) {
  const std::string json =
      with(draft, R"("cutOnFold": [{"x":0,"y":0},{"x":0,"y":180}])", R"("cutOnFold": [{"x":7,"y":0},{"x":7,"y":180}])");
  const auto imported = import(good_spec, json);
  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.issues().front().code, "no_fold_edge");
}

TEST(ImportFreesewing, broken_drafts) {
  const auto code = [](const std::string& json) {
    const auto imported = import("{}", json);
    return imported ? std::string("imported") : imported.issues().front().code;
  };
  EXPECT_EQ(code(""), "bad_json");
  EXPECT_EQ(code(std::string(draft).substr(0, 900)), "bad_json");
  EXPECT_EQ(code("[]"), "bad_draft");
  EXPECT_EQ(code(R"({"parts": 3})"), "bad_draft");
  EXPECT_EQ(code(R"({"parts": {"a": {}}})"), "bad_draft");
  EXPECT_EQ(code(R"({"parts": {}})"), "no_pieces");
  EXPECT_EQ(code(with(draft, R"("neck": [40,-20])", R"("neck": [40])")), "bad_draft");
  EXPECT_EQ(code(with(draft, R"("neck": [40,-20])", R"("neck": [40,"x"])")), "bad_draft");
  EXPECT_EQ(code(with(draft, R"({"type":"move","to":[0,0]}, )", "")), "bad_draft");
  EXPECT_EQ(code(with(draft, R"("cp1":[105,80],)", "")), "bad_draft");
  EXPECT_EQ(code(with(draft, R"("units": "mm")", R"("units": "in")")), "bad_draft");
  const auto imported = import("{}", "{\n \"parts\": {,\n");
  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.issues().front().place.line, 2);
}

namespace {

/// Two halves of a tube, one drawn from behind, with one edge of each kind; cm, y up.
const char* const garmentcode = R"({
 "pattern": {
  "panels": {
   "front": {"translation": [0,0,20], "rotation": [0,0,0], "vertices": [[0,0],[30,0],[30,40],[0,40]],
    "edges": [{"endpoints": [0,1], "curvature": {"type": "circle", "params": [25, 0, 1]}}, {"endpoints": [1,2]},
              {"endpoints": [2,3], "curvature": {"type": "quadratic", "params": [[0.5, 0.1]]}}, {"endpoints": [3,0]}]},
   "back": {"translation": [0,0,-20], "rotation": [0,0,0], "vertices": [[0,0],[0,40],[30,42],[30,0]],
    "edges": [{"endpoints": [0,1]}, {"endpoints": [1,2], "curvature": {"type": "cubic", "params": [[0.3, -0.1], [0.7, -0.1]]}},
              {"endpoints": [2,3]}, {"endpoints": [3,0], "curvature": [0.5, 0.05]}]}
  },
  "stitches": [[{"panel": "front", "edge": 1}, {"panel": "back", "edge": 2}], [{"panel": "front", "edge": 3}, {"panel": "back", "edge": 0}, "right_wrong"]],
  "panel_order": ["front", "back"]
 },
 "properties": {"curvature_coords": "relative", "units_in_meter": 100}
})";

}  // namespace

TEST(ImportGarmentCode, panels_with_their_face_up) {
  const auto imported = import("{}", garmentcode);
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  const Pattern& pattern = imported->pattern;
  EXPECT_FALSE(pattern.y_down);
  ASSERT_EQ(pattern.pieces.size(), 2u);
  const Piece &front = pattern.pieces[0], &back = pattern.pieces[1];
  EXPECT_EQ(front.points.at("v2"), Point2(300, 400));
  EXPECT_EQ(front.outline[0].name, "e0");
  // The arc lies on the right of its edge, that is below: it is 25 - sqrt(25^2 - 15^2) = 5 cm deep.
  EXPECT_NEAR((position(front.outline[0].segments[0], 0.5) - Point2(150, -50)).norm(), 0, 1e-6);
  EXPECT_EQ(front.outline[2].segments[0], quadratic_segment({300, 400}, {150, 370}, {0, 400}));
  // The back is drawn clockwise, as seen from inside the garment: it is turned over.
  EXPECT_EQ(back.points.at("v2"), Point2(-300, 420));
  const auto panels = cut_panels(pattern);
  ASSERT_TRUE(panels);
  for (const CutPanel& panel : *panels) EXPECT_EQ(panel.outline[0].from, "v0");
  // A missing grain line is told.
  EXPECT_EQ(imported->notes.size(), 2u);
  EXPECT_EQ(imported->seams,
            "seams:\n  - {name: s1, a: [front.e1], b: [\"-back.e2\"], ease: 20 mm}\n"
            "  - {name: s2, a: [front.e3], b: [\"back.e0\"], same_direction: true}\n");
}

TEST(ImportGarmentCode, a_spec_names_edges_and_loses_no_stitch_in_silence) {
  const auto imported = import("pieces: [{name: f, part: front, grain: y, edges: {left: v1>v2}}, {name: b, part: back, grain: x}]", garmentcode);
  ASSERT_TRUE(imported) << to_string(imported.issues().front());
  EXPECT_NE(imported->seams.find("a: [f.left], b: [\"-b.e2\"]"), std::string::npos);
  const auto half = import("pieces: [{name: f, part: front, grain: y}]", garmentcode);
  ASSERT_TRUE(half);
  EXPECT_EQ(half->notes.size(), 2u);
  EXPECT_EQ(half->notes[0].code, "stitch_left_out");
}

TEST(ImportGarmentCode, broken_specifications) {
  const auto fails = [](const std::string& part, const std::string& by) {
    const std::string json = with(garmentcode, part, by);
    if (json.empty()) return false;
    const auto imported = import("{}", json);
    return !imported && imported.issues().front().code == "bad_draft";
  };
  EXPECT_TRUE(fails("[30,40]", "[30]"));
  EXPECT_TRUE(fails("\"endpoints\": [1,2]}", "\"endpoints\": [1,9]}"));
  EXPECT_TRUE(fails("\"endpoints\": [1,2]}", "\"endpoints\": [0,2]}"));
  EXPECT_TRUE(fails("[25, 0, 1]", "[5, 0, 1]"));
  EXPECT_TRUE(fails("\"circle\"", "\"spiral\""));
  EXPECT_TRUE(fails("\"edge\": 1}", "\"edge\": 7}"));
  EXPECT_TRUE(fails("\"panel\": \"back\"", "\"panel\": \"bakc\""));
  EXPECT_TRUE(fails("\"relative\"", "\"absolute\""));
  EXPECT_TRUE(fails("\"units_in_meter\": 100", "\"units_in_meter\": 0"));
}

TEST(SamplePatterns, are_what_the_import_makes_of_the_drafts) {
  for (const auto& [design, name] : {std::pair{"teagan", "tee"}, std::pair{"penelope", "skirt"},
                                     std::pair{"jaeger", "jacket"}, std::pair{"wahid", "waistcoat"}}) {
    const std::string folder = "patterns/freesewing/";
    const auto p = params(sample_file(folder + name + ".yaml"));
    const auto imported = io::import_pattern(sample_file(folder + design + ".json"), design, p);
    ASSERT_TRUE(imported) << to_string(imported.issues().front());
    // The jacket's draft has points of other parts and lines that run across seams; all of that is told, nothing else.
    for (const Issue& note : imported->notes) {
      EXPECT_EQ(std::string(name), "jacket") << to_string(note);
      EXPECT_TRUE(note.code == "line_cut" || note.code == "notch_left_out") << to_string(note);
    }
    EXPECT_EQ(io::format_pattern(imported->pattern), sample_file("patterns/" + std::string(name) + ".yaml"));
  }
}

TEST(SamplePatterns, seams_of_the_tee_fit) {
  const auto panels = sample_panels("tee.yaml");
  ASSERT_EQ(panels.size(), 4u);
  EXPECT_NEAR(length(panels, "front", {"side"}), 423.89, 0.01);
  EXPECT_NEAR(length(panels, "back", {"side_m"}), 423.89, 0.01);
  EXPECT_NEAR(length(panels, "front", {"shoulder"}), 98.72, 0.01);
  EXPECT_NEAR(length(panels, "back", {"shoulder"}), 98.72, 0.01);
  EXPECT_NEAR(length(panels, "sleeve", {"underarm_front"}), 55.86, 0.01);
  EXPECT_NEAR(length(panels, "sleeve_m", {"underarm_back"}), 55.86, 0.01);
  EXPECT_NEAR(length(panels, "sleeve", {"cap_front", "cap_back"}), 493.28, 0.01);
  EXPECT_NEAR(length(panels, "front", {"armhole"}) + length(panels, "back", {"armhole"}), 492.83, 0.01);
  // Half against half the draft is uneven by about 1 %: only the whole cap fits the whole armhole.
  EXPECT_NEAR(length(panels, "sleeve", {"cap_front"}) - length(panels, "front", {"armhole"}), -2.67, 0.01);
  EXPECT_NEAR(length(panels, "sleeve", {"cap_back"}) - length(panels, "back", {"armhole"}), 3.12, 0.01);
  // The notches meet: as far from the underarm point on the body as on the sleeve.
  const auto from_underarm = [&](const char* panel, const char* notch, const char* point) {
    const CutPanel& p = *find_panel(panels, panel);
    for (const PanelNotch& n : p.notches) {
      const PanelEdge& edge = *find_edge(p, n.edge);
      if (n.name == notch) return 1e3 * (edge.from == point ? n.s : edge.curve.length() - n.s);
    }
    return -1.0;
  };
  EXPECT_NEAR(from_underarm("front", "armholeNotchFront", "armhole"),
              from_underarm("sleeve", "frontNotch", "bicepsRight"), 1);
  EXPECT_NEAR(from_underarm("back", "armholeNotchBack", "armhole"), from_underarm("sleeve", "backNotch", "bicepsLeft"),
              1);
}

TEST(SamplePatterns, seams_of_the_skirt_fit) {
  const auto panels = sample_panels("skirt.yaml");
  ASSERT_EQ(panels.size(), 4u);
  EXPECT_NEAR(length(panels, "front", {"side"}), 629.36, 0.01);
  EXPECT_NEAR(length(panels, "back_m", {"side"}), 629.72, 0.01);
  for (const char* panel : {"front", "back"}) {
    EXPECT_NEAR(length(panels, panel, {"dart1_side"}), length(panels, panel, {"dart1_centre"}), 0.02);
    EXPECT_NEAR(length(panels, panel, {"dart2_side"}), length(panels, panel, {"dart2_centre"}), 0.02);
  }
  const double waist = 2 * (length(panels, "front", {"waist_side", "waist_middle", "waist_centre"}) +
                            length(panels, "back", {"waist_side", "waist_middle", "waist_centre"}));
  EXPECT_NEAR(waist, 761.4, 0.1);
  EXPECT_NEAR(length(panels, "waistband", {"lower", "lower_m"}), 757.57, 0.01);
}

TEST(SamplePatterns, seams_of_the_jacket_fit) {
  const auto panels = sample_panels("jacket.yaml");
  EXPECT_EQ(panels.size(), 29u);
  struct Row {
    const char* panel_a;
    std::vector<std::string> edges_a;
    double length_a;
    const char* panel_b;
    std::vector<std::string> edges_b;
    double length_b;
  };
  // As measured on the draft itself, but for the stand seam and the outer edge of the collar, which is drawn anew.
  const std::vector<Row> rows{
      {"front", {"dart_side"}, 209.48, "front", {"dart_front"}, 209.48},
      {"front", {"side"}, 439.52, "side", {"front"}, 435.94},
      {"side", {"back"}, 445.36, "back_m", {"side"}, 448.96},
      {"back", {"shoulder"}, 137.91, "front", {"shoulder"}, 137.91},
      {"back", {"centre"}, 683.27, "back_m", {"centre"}, 683.27},
      {"topsleeve", {"inseam"}, 402.00, "undersleeve_m", {"inseam"}, 401.61},
      {"topsleeve", {"outseam"}, 422.73, "undersleeve_m", {"outseam"}, 423.14},
      {"topsleeve", {"vent"}, 101.77, "undersleeve_m", {"vent"}, 101.77},
      {"undercollar", {"gorge"}, 66.52, "front", {"gorge"}, 66.52},
      {"collar", {"stand"}, 164.46, "collar_stand", {"collar"}, 164.46},
      {"collar", {"outer"}, 186.52, "undercollar", {"outer"}, 187.00},
      {"facing", {"gorge", "lapel_top", "lapel", "front"}, 798.21, "front", {"gorge", "lapel_top", "lapel", "front"}, 798.21},
      {"facing", {"inner"}, 707.07, "front_lining", {"inner"}, 687.07},
  };
  for (const Row& row : rows) {
    const double a = length(panels, row.panel_a, row.edges_a), b = length(panels, row.panel_b, row.edges_b);
    EXPECT_NEAR(a, row.length_a, 0.01) << row.panel_a << "." << row.edges_a.front();
    EXPECT_NEAR(b, row.length_b, 0.01) << row.panel_b << "." << row.edges_b.front();
    if (std::string(row.panel_b) != "front_lining") {
      EXPECT_LT(std::abs(a - b) / b, 0.009);
    }
  }
  const auto sum = [&](const std::vector<std::pair<const char*, const char*>>& edges) {
    double total = 0;
    for (const auto& [panel, edge] : edges) total += length(panels, panel, {edge});
    return total;
  };
  EXPECT_NEAR(sum({{"topsleeve", "cap_back"}, {"topsleeve", "cap_front"}, {"undersleeve", "cap"}}), 525.23, 0.01);
  EXPECT_NEAR(sum({{"front", "armhole"}, {"side", "armhole"}, {"back", "armhole"}}), 518.48, 0.01);
  EXPECT_NEAR(sum({{"front", "neck"}, {"back", "neck"}}), 154.91, 0.01);
  EXPECT_NEAR(length(panels, "undercollar", {"neck"}), 155.02, 0.01);
  EXPECT_NEAR(length(panels, "collar_stand", {"neck"}), 155.02, 0.01);
}

TEST(SamplePatterns, seams_of_the_waistcoat_fit) {
  const auto panels = sample_panels("waistcoat.yaml");
  EXPECT_EQ(panels.size(), 10u);
  EXPECT_NEAR(length(panels, "front", {"dart_front"}), 308.97, 0.01);
  EXPECT_NEAR(length(panels, "front", {"dart_side"}), 308.97, 0.01);
  EXPECT_NEAR(length(panels, "back", {"dart_centre"}), 296.99, 0.01);
  EXPECT_NEAR(length(panels, "back", {"dart_side"}), 296.99, 0.01);
  EXPECT_NEAR(length(panels, "front", {"side"}), 333.37, 0.01);
  EXPECT_NEAR(length(panels, "back_m", {"side"}), 333.08, 0.01);
  EXPECT_NEAR(length(panels, "front", {"shoulder"}), 116.09, 0.01);
  EXPECT_NEAR(length(panels, "back_m", {"shoulder"}), 116.09, 0.01);
  EXPECT_NEAR(length(panels, "back", {"centre"}), 576.71, 0.01);
  EXPECT_NEAR(length(panels, "facing", {"inner"}), length(panels, "front_lining", {"inner"}), 0.01);
}
