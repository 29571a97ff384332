#include "nodes/projector/layer_status.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostReasons = 32;

void count(std::map<std::string, std::uint64_t>& reasons, const std::string& reason) {
  const bool is_full = reasons.size() >= kMostReasons && reasons.count(reason) == 0;
  ++reasons[is_full ? "other reasons" : reason];
}

}  // namespace

void LayerStatus::drop(const std::string& reason) { count(dropped, reason); }
void LayerStatus::remark(const std::string& reason) { count(remarks, reason); }

}  // namespace afterglow::nodes
