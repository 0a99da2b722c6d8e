// A garment's pipeline: which program makes which artefact from what. From it come make rules.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "toile/base/fields.h"

namespace toile::stage {

struct PipelineStage {
  std::string tool;
  std::map<std::string, std::vector<std::string>> in;  ///< port -> `$input`, the name of a stage, or stage.parameter for a file beside its result
  std::string spec;                                    ///< file beside the pipeline; empty: defaults
  std::map<std::string, std::string> set;              ///< single parameters, as on the command line
  std::map<std::string, std::string> out;              ///< parameters that name further files: name in the garment's folder
  static void describe(auto& f) {
    f(&PipelineStage::tool, {.key = "tool", .doc = "program, e.g. toile-mesh", .required = true});
    f(&PipelineStage::in, {.key = "in", .doc = "input port: $name of an input, a stage, or stage.parameter for what its `out` names"});
    f(&PipelineStage::spec, {.key = "spec", .doc = "parameter file, relative to the pipeline"});
    f(&PipelineStage::set, {.key = "set", .doc = "single parameters, as on the command line"});
    f(&PipelineStage::out, {.key = "out", .doc = "parameters that name files written beside the result, such as `record`: their names in the garment's folder"});
  }
};

struct Pipeline {
  std::string garment;
  std::map<std::string, std::string> inputs;
  std::map<std::string, PipelineStage> stages;
  std::vector<std::string> results;
  static void describe(auto& f) {
    f(&Pipeline::garment, {.key = "garment", .doc = "name; the folder of the artefacts", .required = true});
    f(&Pipeline::inputs, {.key = "inputs", .doc = "name: file, relative to the pipeline"});
    f(&Pipeline::stages, {.key = "stages", .doc = "one entry an artefact", .required = true});
    f(&Pipeline::results, {.key = "results", .doc = "stages to make and to name at the end; none: all"});
  }
};

/// What a plan needs to know of a program.
struct ToolInfo {
  struct Port {
    std::string name;
    bool required = true, many = false;
  };
  std::string path;       ///< of the program
  std::string extension;  ///< of its output, e.g. ".ply"
  std::vector<Port> ports;
};

/// Asks a program for its ToolInfo; an issue if there is no such program.
using ToolQuery = std::function<Result<ToolInfo>(const std::string& tool)>;

/// One artefact of a plan: the command is engine-neutral; a writer turns steps into rules.
struct Step {
  std::string stage;
  std::string output;                 ///< path
  std::vector<std::string> needs;     ///< files that must be there and older: inputs, spec, program
  std::vector<std::string> command;   ///< words
};
struct Plan {
  std::string garment, folder;        ///< artefacts are in folder
  std::vector<Step> steps;            ///< each after those it needs
  std::vector<std::string> results;   ///< paths
};

/// Resolves references, orders stages and checks ports and files; all mistakes at once.
/// pipeline_folder, build_folder  absolute
/// error  "unknown_tool", "unknown_reference", "unknown_port", "missing_port", "cycle", "missing_file", "bad_name"
Result<Plan> make_plan(const Pipeline& pipeline, const std::string& pipeline_file, const std::string& pipeline_folder, const std::string& build_folder, const ToolQuery& query);

/// GNU make rules: one rule a step, one file an artefact. A step runs again when its program, an input, its spec or its
/// command changed. What a failing program still wrote (exit 4 or 5) is kept as NAME.rejected.EXT; the exit code
/// of the last failing program stands in folder/.exit_code.
std::string make_rules(const Plan& plan);

}  // namespace toile::stage
