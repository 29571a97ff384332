/// \file
/// Things to draw, by the bands of rows that they touch.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "render/compose/workers.hpp"

namespace afterglow::render {

/// The image is painted in bands that fit a core's cache.
constexpr int kBandRows = 16;

/// Runs of items, each run in its order within every band. Keeps its buffers.
template <typename Item>
class BandBins {
 public:
  struct Bin {
    std::size_t first = 0, count = 0;
  };

  void begin(int bands) {
    bands_ = bands;
    used_ = 0;
    bins_.clear();
  }

  /// rowsOf(i): the first row that item i touches and the last, in any order with the image's;
  /// itemOf(i): the item. Counted first, so that each worker knows where its part goes.
  template <typename RowsOf, typename ItemOf>
  void add(std::size_t count, Workers& workers, const RowsOf& rowsOf, const ItemOf& itemOf) {
    filled_.resize(static_cast<std::size_t>(workers.sharers(count)));
    const auto eachBand = [&](std::size_t i, const auto& visit) {
      const auto [top, bottom] = rowsOf(i);
      const int last = std::min(bands_ * kBandRows - 1, bottom) / kBandRows;
      if (bottom < 0) return;
      for (int band = std::max(0, top) / kBandRows; band <= last; ++band) {
        visit(static_cast<std::size_t>(band));
      }
    };
    workers.share(count, [&](int worker, std::size_t begin, std::size_t end) {
      auto& filled = filled_[static_cast<std::size_t>(worker)];
      filled.assign(static_cast<std::size_t>(bands_), 0);
      for (std::size_t i = begin; i < end; ++i) {
        eachBand(i, [&](std::size_t band) { ++filled[band]; });
      }
    });
    placeBins();
    workers.share(count, [&](int worker, std::size_t begin, std::size_t end) {
      auto& filled = filled_[static_cast<std::size_t>(worker)];
      for (std::size_t i = begin; i < end; ++i) {
        eachBand(i, [&](std::size_t band) { items_[filled[band]++] = itemOf(i); });
      }
    });
  }

  std::size_t runs() const { return bins_.size() / static_cast<std::size_t>(bands_); }
  const Bin& bin(std::size_t run, int band) const {
    return bins_[run * static_cast<std::size_t>(bands_) + static_cast<std::size_t>(band)];
  }
  const Item* items(const Bin& bin) const { return items_.data() + bin.first; }

 private:
  void placeBins() {
    for (std::size_t band = 0; band < static_cast<std::size_t>(bands_); ++band) {
      Bin bin{used_, 0};
      for (auto& filled : filled_) used_ += std::exchange(filled[band], used_);
      bin.count = used_ - bin.first;
      bins_.push_back(bin);
    }
    if (items_.size() < used_) items_.resize(used_ + used_ / 4);
  }

  int bands_ = 0;
  std::size_t used_ = 0;
  std::vector<Bin> bins_;  ///< a band's of each run, run by run
  std::vector<Item> items_;
  std::vector<std::vector<std::size_t>> filled_;  ///< the filled bins, by worker and band
};

}  // namespace afterglow::render
