/// \file
/// A list whose copies share their elements until one of them is changed: clouds pass from message
/// to scene to image, and from thread to thread, without being copied.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

namespace afterglow::render {

/// A value as std::vector is: a change of a copy changes that copy alone. The last copy to go frees
/// the elements. Different copies may be used in different threads.
template <typename T>
class SharedList {
 public:
  using value_type = T;
  using const_iterator = typename std::vector<T>::const_iterator;
  using iterator = const_iterator;  ///< elements are changed through edit() alone

  SharedList() = default;
  SharedList(std::vector<T> elements)
      : elements_(std::make_shared<std::vector<T>>(std::move(elements))) {}
  SharedList(std::initializer_list<T> elements) : SharedList(std::vector<T>(elements)) {}

  const std::vector<T>& get() const {
    static const std::vector<T> none;
    return elements_ ? *elements_ : none;
  }
  operator const std::vector<T>&() const { return get(); }
  std::size_t size() const { return get().size(); }
  bool empty() const { return get().empty(); }
  const_iterator begin() const { return get().begin(); }
  const_iterator end() const { return get().end(); }
  const T& operator[](std::size_t i) const { return get()[i]; }
  const T& at(std::size_t i) const { return get().at(i); }
  const T& front() const { return get().front(); }
  const T& back() const { return get().back(); }

  /// Elements that are this copy's own, to be changed before it is copied again.
  std::vector<T>& edit() {
    if (!elements_) {
      elements_ = std::make_shared<std::vector<T>>();
    } else if (elements_.use_count() > 1) {
      elements_ = std::make_shared<std::vector<T>>(*elements_);
    }
    return *elements_;
  }
  void push_back(const T& element) { edit().push_back(element); }
  template <typename... Arguments>
  void emplace_back(Arguments&&... arguments) {
    edit().emplace_back(std::forward<Arguments>(arguments)...);
  }

  friend bool operator==(const SharedList& a, const SharedList& b) { return a.get() == b.get(); }

 private:
  std::shared_ptr<std::vector<T>> elements_;
};

}  // namespace afterglow::render
