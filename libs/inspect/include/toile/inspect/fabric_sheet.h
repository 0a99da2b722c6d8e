// What a fabric card comes to: figures for people and programs, curves as tables and plots.
#pragma once

#include "toile/fabric/constitutive.h"
#include "toile/fabric/measured.h"
#include "toile/fabric/plausibility.h"
#include "toile/inspect/json.h"
#include "toile/inspect/plot.h"

#include <map>
#include <string>
#include <vector>

namespace toile::inspect {

/// Everything that is shown of one fabric.
struct FabricSheet {
  fabric::Card card;
  std::map<std::string, std::string> source;
  fabric::Constitutive data;
  std::vector<fabric::Judged> judged;
  fabric::Plausibility plausibility;
};

/// error  what fabric::resolve and fabric::constitutive report
Result<FabricSheet> fabric_sheet(const fabric::Measured& measured);

std::string fabric_text(const FabricSheet& sheet);
Json fabric_json(const FabricSheet& sheet);
/// curve,direction,x,elastic,loading,unloading,slope: one row a point, SI.
std::string fabric_csv(const FabricSheet& sheet);
/// Tension, shear, bending and the slope of tension.
std::vector<Chart> fabric_charts(const FabricSheet& sheet);

}  // namespace toile::inspect
