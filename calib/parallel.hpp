/// \file
/// Independent pieces of work on a few threads.
#pragma once

#include <cstddef>
#include <functional>

namespace afterglow::calib {

/// Calls work(0) ... work(count - 1), begun in this order, on so many threads, and returns when all
/// are done. After an exception no more work is begun, and that of the lowest index is thrown on,
/// whichever came first.
void forEachIndex(std::size_t count, int threads, const std::function<void(std::size_t)>& work);

}  // namespace afterglow::calib
