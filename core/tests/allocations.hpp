// Counts allocations, those of C too where the linker wraps its functions (`--wrap=malloc`). For one
// source file of a program.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

namespace pushplan::tests {

inline std::size_t allocations = 0;

/// True if a call allocates.
template <class Call>
bool allocates(const Call& call) {
  const std::size_t before = allocations;
  call();
  return allocations != before;
}

}  // namespace pushplan::tests

#ifdef __linux__
extern "C" {
void* __real_malloc(std::size_t size);
void* __real_calloc(std::size_t count, std::size_t size);
void* __real_realloc(void* old, std::size_t size);
void* __wrap_malloc(std::size_t size) {
  ++pushplan::tests::allocations;
  return __real_malloc(size);
}
void* __wrap_calloc(std::size_t count, std::size_t size) {
  ++pushplan::tests::allocations;
  return __real_calloc(count, size);
}
void* __wrap_realloc(void* old, std::size_t size) {
  ++pushplan::tests::allocations;
  return __real_realloc(old, size);
}
}
#endif

// not inlined: a compiler that sees `free` beside `new` takes it for a mistake
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++pushplan::tests::allocations;
  if (void* made = std::malloc(size)) return made;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
