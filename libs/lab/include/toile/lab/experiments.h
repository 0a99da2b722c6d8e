// The tests of the virtual laboratory: what is to be run, and what its results come to. Nothing is run here (tools/toile-lab.cpp
// does), so that tests can judge made-up results.
#pragma once

#include "toile/lab/report.h"
#include "toile/mesh/garment_mesh.h"

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace toile::lab {

struct File {
  std::string name, text;
};

/// A program and its arguments, run in the case's folder, or (`edit`) a change of the positions of a garment file: `args` are then
/// the file that is read and the one that is written.
struct Step {
  std::string tool;
  std::vector<std::string> args;
  std::function<mesh::GarmentMesh(mesh::GarmentMesh)> edit;
};

/// One pipeline, in a folder of its own.
struct Case {
  std::string name;
  std::vector<File> files;
  std::vector<Step> steps;
};

/// Columns of a CSV file by name.
using Table = std::map<std::string, std::vector<double>>;

/// What became of a case.
struct Outcome {
  bool ran = false;                      ///< all programs gave a result, if only an unconverged one
  bool converged = false;
  std::string trouble;                   ///< what the program that stopped it said
  std::map<std::string, double> facts;   ///< of the last program's summary, by name without unit
  Table record;                          ///< record.csv, if it was written
  mesh::GarmentMesh garment;             ///< the last garment, where the experiment asks for it
};

struct Experiment {
  std::string test, title, about;
  std::vector<Case> cases;
  bool wants_garments = false;
  std::function<Section(const std::vector<Outcome>&)> judge;  ///< outcomes in the order of the cases
};

struct Scope {
  bool quick = false;
  bool woven = true, particle = true;
};

/// Names and titles of all tests, in order of the report.
std::vector<std::pair<std::string, std::string>> test_names();
/// Empty `only`: all. Precondition: every name in `only` is a test's.
std::vector<Experiment> experiments(const Scope& scope, const std::vector<std::string>& only);

/// Text of a CSV file with one row of names. A cell that is no number is NaN.
Table parse_csv(const std::string& text);
/// Facts of a program's --json summary by name without unit ("bending_energy"); flags as 0 and 1.
std::map<std::string, double> parse_facts(const std::string& json);
/// What the first issue of a --json summary says; empty where there is none.
std::string first_issue(const std::string& json);

}  // namespace toile::lab
