// Large arrays of which little is used.
#pragma once

#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

#include "pushplan/array.hpp"

namespace pushplan {

/// Zeros whose memory is taken from the system where it is first used.
template <class T>
  requires std::is_trivially_copyable_v<T>
class ZeroedArray {
 public:
  explicit ZeroedArray(Index size)
      : values_(static_cast<T*>(
            std::calloc(static_cast<std::size_t>(size > 0 ? size : 1), sizeof(T)))) {
    if (!values_) throw std::bad_alloc();
  }

  T* data() const { return values_.get(); }
  T& operator[](Index i) const { return values_.get()[i]; }

 private:
  struct Free {
    void operator()(T* values) const { std::free(values); }
  };

  std::unique_ptr<T, Free> values_;
};

}  // namespace pushplan
