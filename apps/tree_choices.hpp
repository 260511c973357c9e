#pragma once
/// The words that stand for how a tree is grown and thinned, shared by all subcommands.
#include "command_line.hpp"
#include "wienertree/cubature/flow.hpp"
#include "wienertree/thinning/thinning.hpp"

namespace wienertree::app {

inline const Choices<ThinningMethod> thinnings = {{"none", ThinningMethod::none},
                                                  {"tbba", ThinningMethod::tbba},
                                                  {"multinomial", ThinningMethod::multinomial},
                                                  {"residual", ThinningMethod::residual},
                                                  {"stratified", ThinningMethod::stratified},
                                                  {"systematic", ThinningMethod::systematic},
                                                  {"recombination", ThinningMethod::recombination},
                                                  {"levelwise", ThinningMethod::levelwise},
                                                  {"heavy-first", ThinningMethod::heavy_first}};
inline const Choices<SiteOrder> orders = {{"tree", SiteOrder::tree}, {"spatial", SiteOrder::spatial}};
inline const Choices<FlowMethod> flows = {{"auto", FlowMethod::automatic},
                                          {"exact", FlowMethod::exact},
                                          {"explicit", FlowMethod::explicit_},
                                          {"cvode", FlowMethod::cvode}};

}  // namespace wienertree::app
