#pragma once
#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Common base of StateWriter and StateReader: one enumeration of a type's fields serves both. A type names
/// its fields once,
///
///     template <class Archive> void visit_state(Archive& archive) { archive(stamp, pose, features); }
///
/// Fields are numbers (little endian, exactly), bool, enums (StateBytes::choice), fixed-size matrices of
/// Eigen, Time, SE3, strings, arrays, vectors, deques, optionals, and types with visit_state().
template <class Self>
class StateBytes {
 public:
  template <class... Fields>
  void operator()(Fields&... fields) {
    (field(fields), ...);
  }
  /// A field that is an enum of `count` values from 0.
  template <class Enum>
  requires std::is_enum_v<Enum>
  void choice(Enum& value, int count) {
    auto number = static_cast<std::int32_t>(value);
    field(number);
    self().require(number >= 0 && number < count);
    if constexpr (Self::kReads)
      if (self().ok()) value = static_cast<Enum>(number);
  }

 private:
  Self& self() { return static_cast<Self&>(*this); }

  template <class T>
  void field(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      self().number(value);
    } else if constexpr (std::is_same_v<T, Time>) {
      field(value.ns);
    } else if constexpr (std::is_same_v<T, SE3>) {
      pose(value);
    } else if constexpr (requires { T::SizeAtCompileTime; }) {
      static_assert(T::SizeAtCompileTime > 0);
      for (Eigen::Index i = 0; i < value.size(); ++i) field(value.data()[i]);
    } else if constexpr (requires { value.push_back(std::declval<typename T::value_type>()); }) {
      items(value);
    } else if constexpr (requires { value.has_value(); }) {
      maybe(value);
    } else if constexpr (requires { std::tuple_size<T>::value; }) {
      for (auto& item : value) field(item);
    } else {
      value.visit_state(self());
    }
  }

  void pose(SE3& value) {
    Mat3 rotation = value.rotation();
    Vec3 translation = value.translation();
    field(rotation);
    field(translation);
    if constexpr (Self::kReads) {
      value = SE3(rotation, translation);
      self().require(is_rigid(value));
    }
  }

  template <class Items>
  void items(Items& values) {
    std::uint64_t count = values.size();
    field(count);
    if constexpr (Self::kReads) {
      values.clear();  // grows with what is really there: a count alone costs no memory
      while (count-- > 0 && self().ok()) field(values.emplace_back());
    } else {
      for (auto& value : values) field(value);
    }
  }
  void items(std::string& text) { raw(text); }
  void items(std::vector<std::uint8_t>& bytes) { raw(bytes); }
  template <class Bytes>
  void raw(Bytes& bytes) {
    std::uint64_t count = bytes.size();
    field(count);
    self().block(bytes, count);
  }

  template <class T>
  void maybe(std::optional<T>& value) {
    bool is_set = value.has_value();
    field(is_set);
    if constexpr (Self::kReads) {
      value.reset();
      if (is_set && self().ok()) value.emplace();
    }
    if (value) field(*value);
  }
};

/// Writes state to bytes. Takes what it writes by reference as StateReader does, and does not change it.
class StateWriter : public StateBytes<StateWriter> {
 public:
  static constexpr bool kReads = false;
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }
  [[nodiscard]] static bool ok() { return true; }
  /// A condition that what is read must fulfil.
  void require(bool /*condition*/) {}

 private:
  friend class StateBytes<StateWriter>;
  template <class T>
  void number(const T& value) {
    append(&value, sizeof value);
  }
  template <class Bytes>
  void block(const Bytes& bytes, std::uint64_t count) {
    append(bytes.data(), count);
  }
  void append(const void* from, std::size_t count) {
    const auto* begin = static_cast<const std::uint8_t*>(from);
    bytes_.insert(bytes_.end(), begin, begin + count);
  }

  std::vector<std::uint8_t> bytes_;
};

/// Reads state from bytes, never beyond their end. What is missing, a number that is not finite, a pose that
/// is not rigid or an unmet require() makes ok() false for good, and the values meaningless.
class StateReader : public StateBytes<StateReader> {
 public:
  static constexpr bool kReads = true;
  explicit StateReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size(); }
  void require(bool condition) { ok_ = ok_ && condition; }

 private:
  friend class StateBytes<StateReader>;
  template <class T>
  void number(T& value) {
    value = {};
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;
      number(byte);
      require(byte <= 1);
      value = byte == 1;
    } else {
      require(bytes_.size() >= sizeof value);
      if (!ok_) return;
      std::memcpy(&value, bytes_.data(), sizeof value);
      bytes_ = bytes_.subspan(sizeof value);
      if constexpr (std::is_floating_point_v<T>) require(std::isfinite(value));
    }
  }
  template <class Bytes>
  void block(Bytes& bytes, std::uint64_t count) {
    require(count <= bytes_.size());
    bytes.clear();
    if (!ok_) return;
    const auto taken = bytes_.first(count);
    bytes.assign(taken.begin(), taken.end());
    bytes_ = bytes_.subspan(count);
  }

  std::span<const std::uint8_t> bytes_;
  bool ok_ = true;
};

}  // namespace hm
