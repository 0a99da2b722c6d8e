// The cloth's side: a support whose bodies another program moves.
#pragma once

#include "toile/coupling/channel.h"
#include "toile/dynamics/support_motion.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace toile::coupling {

struct CoupledOptions {
  std::string model;                 ///< content hash that the master has to say, or empty
  std::vector<std::string> known;    ///< bodies that the simulation has: regions of the support, and what cloth is held to; the master's others are left out
  double longest_step = 0;           ///< [s]
  std::function<bool()> interrupted;
};

/// Listens, and waits for a master and its introduction. Steps longer than what the simulator can do are refused before it hears of them; of a step that the simulator
/// gave up, the master hears how long the next one may be.
/// error  those of Cloth::meet; "other_model"; "unknown_body" where none is known
Result<std::unique_ptr<dynamics::SupportMotion>> coupled_motion(const ChannelOptions& options, const CoupledOptions& coupled);
/// The same on a channel that is there already.
Result<std::unique_ptr<dynamics::SupportMotion>> coupled_motion(Channel channel, const CoupledOptions& coupled);

}  // namespace toile::coupling
