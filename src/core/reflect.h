// SPDX-License-Identifier: Apache-2.0
// core/reflect: one description of the members of a type, used by every archive: writer, reader, hasher and validator of a
// state. The description is in a reflect header of the room (solver/reflect.h, suture/reflect.h, ...). It lists members once:
//
//   constexpr void reflect(auto& a, Like<Bite> auto& b) {
//     a(b.entry), a(b.depth);                 // any value
//     a.index(b.nearest, IndexOf::tissue);    // an index: below the size of its domain
//     a.at_most(b.phase, NeedlePhase::back_in);
//     a.cache(b.where);                       // working memory: not part of the state
//   }
//
// A new member is added there; tests/sim/reflect_test finds forgotten members.
#pragma once
#include <array>
#include <concepts>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "core/id.h"
#include "core/math.h"

namespace catgut {

// T or const T: one reflect serves archives that read and archives that write.
template <typename T, typename Of>
concept Like = std::same_as<std::remove_const_t<T>, Of>;

// Base of all archives: restrictions on values concern the validator alone.
template <typename Self>
struct Archive {
  // v is below the size of `domain`.
  template <typename T, typename Domain>
  constexpr void index(T& v, Domain) {
    self()(v);
  }
  // The same, or -1.
  template <typename T, typename Domain>
  constexpr void index_or_none(T& v, Domain) {
    self()(v);
  }
  // v <= last: a count, or an enumerator.
  template <typename T, typename Limit>
  constexpr void at_most(T& v, Limit) {
    self()(v);
  }
  // A column with one entry for each element of `domain`.
  template <typename T, typename Domain>
  constexpr void column(T& v, Domain) {
    self()(v);
  }
  // A column that holds every element of `domain` once.
  template <typename T, typename Domain>
  constexpr void permutation(T& v, Domain) {
    self()(v);
  }
  // From here on `domain` has `size` elements.
  template <typename Domain>
  constexpr void domain(Domain, size_t) {}
  template <typename T>
  constexpr void cache(T&) {}

 private:
  constexpr Self& self() { return static_cast<Self&>(*this); }
};

constexpr void reflect(auto& a, Like<Vec3> auto& v) { a(v.x), a(v.y), a(v.z); }
constexpr void reflect(auto& a, Like<Quat> auto& q) { a(q.x), a(q.y), a(q.z), a(q.w); }
constexpr void reflect(auto& a, Like<Pose> auto& p) { a(p.p), a(p.q); }
template <typename Tag>
constexpr void reflect(auto& a, Id<Tag>& id) {
  a(id.index), a(id.generation);
}
template <typename Tag>
constexpr void reflect(auto& a, const Id<Tag>& id) {
  a(id.index), a(id.generation);
}

template <typename T>
constexpr bool kLeaf = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <typename T>
constexpr bool kIsArray = false;
template <typename T, size_t n>
constexpr bool kIsArray<std::array<T, n>> = true;
template <typename T>
constexpr bool kIsVector = false;
template <typename T, typename Alloc>
constexpr bool kIsVector<std::vector<T, Alloc>> = true;

// Calls a(element) or reflect(a, value), whichever the value has.
constexpr void visit(auto& a, auto& v) {
  if constexpr (kIsArray<std::remove_cvref_t<decltype(v)>>) {
    for (auto& element : v) a(element);
  } else {
    reflect(a, v);
  }
}

// Adds up the members that a reflect names.
struct CountBytes : Archive<CountBytes> {
  size_t bytes = 0;
  bool copyable = true;  // every bit pattern of every member is valid
  template <typename T>
  constexpr void operator()(T& v) {
    if constexpr (std::is_same_v<T, bool>) copyable = false;
    if constexpr (kLeaf<T>) bytes += sizeof v;
    else visit(*this, v);
  }
};

// A type without padding whose reflect lists every byte can be copied as raw bytes.
template <typename T>
constexpr bool is_packed() {
  if constexpr (std::is_same_v<T, bool>) {
    return false;
  } else if constexpr (kLeaf<T>) {
    return true;
  } else if constexpr (std::is_trivially_copyable_v<T>) {
    CountBytes count;
    T value{};
    count(value);
    return count.copyable && count.bytes == sizeof(T);
  } else {
    return false;
  }
}
template <typename T>
constexpr bool kPacked = is_packed<T>();

}  // namespace catgut
