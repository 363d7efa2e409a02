// The smallest of test tools: a failed check is printed, and `finish` is what `main` returns.
#pragma once

#include <cstdio>

namespace pushplan::tests {

inline int failed = 0;

inline void check(bool holds, const char* what, const char* file, int line) {
  if (holds) return;
  ++failed;
  std::fprintf(stderr, "%s:%d: %s does not hold\n", file, line, what);
}

inline int finish() {
  std::printf("%d checks failed\n", failed);
  return failed == 0 ? 0 : 1;
}

}  // namespace pushplan::tests

#define CHECK(condition) ::pushplan::tests::check((condition), #condition, __FILE__, __LINE__)
