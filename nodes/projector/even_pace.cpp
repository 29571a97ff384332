#include "nodes/projector/even_pace.hpp"

#include <algorithm>

namespace afterglow::nodes {

void EvenPace::add(Duration drawing) {
  last_[next_] = drawing;
  next_ = (next_ + 1) % last_.size();
}

EvenPace::Duration EvenPace::interval() const {
  auto sorted = last_;
  std::sort(sorted.begin(), sorted.end());
  return sorted[sorted.size() / 2] > period_ ? sorted.back() : period_;
}

}  // namespace afterglow::nodes
