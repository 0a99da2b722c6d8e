// Parameters of a simulation whose support may be moved by another program.
#pragma once

#include "toile/coupling/coupled_motion.h"
#include "toile/dynamics/simulate.h"

namespace toile::coupling {

struct CoupledSimulationParams : dynamics::SimulationParams {
  std::optional<ChannelOptions> couple;

  /// Fields of the simulation as fields of these parameters.
  template <class F>
  struct Inherited {
    F& f;
    template <class M>
    void operator()(M dynamics::SimulationParams::*member, FieldInfo info) {
      f(static_cast<M CoupledSimulationParams::*>(member), info);
    }
    void check(std::function<void(const dynamics::SimulationParams&, Issues&)> condition) {
      f.check([condition = std::move(condition)](const CoupledSimulationParams& p, Issues& issues) { condition(p, issues); });
    }
  };
  template <class F>
  static void describe(F& f) {
    Inherited<F> inherited{f};
    dynamics::SimulationParams::describe(inherited);
    f(&CoupledSimulationParams::couple, {.key = "couple", .doc = "motion: another program moves the bodies of the support and hears what the cloth does to them (docs/coupling.md); toile-drive is one. Not given: none"});
    f.check([](const CoupledSimulationParams& p, Issues& issues) {
      if (!p.couple) return;
      const auto bad = [&](const char* what, const char* remedy) { issues.push_back(Issue{"bad_combination", {.item = "couple"}, what, remedy}); };
      if (p.mode != dynamics::Mode::motion) bad("a support moves in motion only", "write `mode: motion`");
      if (p.integrator == dynamics::Integrator::provot) bad("steps can be taken back by the implicit integrators only", "write `integrator: bdf2` or implicit, or take a table of the motion");
      if (!p.checkpoint.empty() || !p.resume.empty()) bad("the other program's state is in no checkpoint", "leave out checkpoint and resume");
    });
  }
};

/// Waits for the program that moves the support. The drawing of its bodies is to be that which the support was made from, where its route says.
/// Precondition: params.couple
/// error  those of coupled_motion
Result<std::unique_ptr<dynamics::SupportMotion>> coupled_support(const CoupledSimulationParams& params, const std::optional<mesh::SupportMesh>& support, std::function<bool()> interrupted);

}  // namespace toile::coupling
