// Work that may pause anywhere and go on later, as a coroutine.
//
// A search that looks at the clock from deep within its calls would need a way back out of them.
// Here a call that has to wait suspends, `PathPlanner::run` returns to whoever planned, and the next `run`
// resumes the innermost call.
#pragma once

#include <chrono>
#include <coroutine>
#include <exception>
#include <optional>
#include <utility>

namespace pushplan {

/// A call that may pause; it begins when it is awaited, and its frame dies with it. What it is given
/// by value has to have a name: gcc 12 frees a temporary twice.
template <class T>
class [[nodiscard]] Task;

namespace tasks {

struct Promise {
  struct Final {
    bool await_ready() noexcept { return false; }
    template <class P>
    std::coroutine_handle<> await_suspend(std::coroutine_handle<P> ended) noexcept {
      const auto caller = ended.promise().caller;
      return caller ? caller : std::noop_coroutine();
    }
    void await_resume() noexcept {}
  };

  std::suspend_always initial_suspend() noexcept { return {}; }
  Final final_suspend() noexcept { return {}; }
  void unhandled_exception() { error = std::current_exception(); }

  std::coroutine_handle<> caller{};
  std::exception_ptr error{};
};

template <class T>
struct ValuePromise : Promise {
  Task<T> get_return_object();
  template <class U>
  void return_value(U&& returned) {
    value.emplace(std::forward<U>(returned));
  }
  T take() { return std::move(*value); }
  std::optional<T> value{};
};

template <>
struct ValuePromise<void> : Promise {
  Task<void> get_return_object();
  void return_void() {}
  void take() {}
};

}  // namespace tasks

template <class T>
class [[nodiscard]] Task {
 public:
  using promise_type = tasks::ValuePromise<T>;
  using Handle = std::coroutine_handle<promise_type>;

  explicit Task(Handle handle) : handle_(handle) {}
  Task(Task&& other) noexcept : handle_(std::exchange(other.handle_, {})) {}
  Task& operator=(Task&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Task() {
    if (handle_) handle_.destroy();
  }

  bool await_ready() const noexcept { return false; }
  std::coroutine_handle<> await_suspend(std::coroutine_handle<> caller) noexcept {
    handle_.promise().caller = caller;
    return handle_;
  }
  T await_resume() {
    if (handle_.promise().error) std::rethrow_exception(handle_.promise().error);
    return handle_.promise().take();
  }

  Handle handle() const { return handle_; }

 private:
  Handle handle_;
};

template <class T>
Task<T> tasks::ValuePromise<T>::get_return_object() {
  return Task<T>(Task<T>::Handle::from_promise(*this));
}
inline Task<void> tasks::ValuePromise<void>::get_return_object() {
  return Task<void>(Task<void>::Handle::from_promise(*this));
}

/// Where work pauses, and from where it goes on.
class Pauses {
 public:
  /// A point at which work suspends if something has changed that a stop rule may ask for, or about
  /// half a millisecond has passed. So rules that count see the same, whatever the clock says.
  struct Point {
    Pauses* pauses;
    bool await_ready() const { return !pauses->is_due(); }
    void await_suspend(std::coroutine_handle<> here) const { pauses->innermost_ = here; }
    void await_resume() const {}
  };

  Point point() { return {this}; }
  /// Tells that the number of iterations or the best cost is another one.
  void change() { changed_ = true; }

  /// Begins a call, which runs to its first pause with the next `resume`.
  void begin(std::coroutine_handle<> call) { innermost_ = call; }
  /// Goes on to the next pause.
  void resume() {
    changed_ = false;
    resumed_ = std::chrono::steady_clock::now();
    innermost_.resume();
  }

 private:
  static constexpr std::chrono::microseconds kPiece{500};

  bool is_due() const {
    return changed_ || std::chrono::steady_clock::now() - resumed_ >= kPiece;
  }

  std::coroutine_handle<> innermost_{};
  bool changed_ = false;
  std::chrono::steady_clock::time_point resumed_{};
};

}  // namespace pushplan
