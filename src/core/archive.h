// SPDX-License-Identifier: Apache-2.0
// core/archive: archives that write, read and hash every type with a reflect (core/reflect.h). Little endian, no padding: the
// output is the same on every machine, and the hash of a value is the hash of its bytes.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "core/check.h"
#include "core/hash.h"
#include "core/reflect.h"

namespace catgut {

static_assert(std::endian::native == std::endian::little, "archives copy columns as they lie in memory");

// Writes to anything with bytes(pointer, count).
template <typename Sink>
struct Writer : Archive<Writer<Sink>> {
  Sink& sink;
  explicit Writer(Sink& s) : sink(s) {}

  template <typename T>
  void operator()(const T& v) {
    if constexpr (kPacked<T>) sink.bytes(&v, sizeof v);
    else if constexpr (std::is_same_v<T, bool>) (*this)(static_cast<uint8_t>(v));
    else visit(*this, v);
  }
  template <typename T, typename Alloc>
  void operator()(const std::vector<T, Alloc>& v) {
    const uint64_t n = v.size();
    (*this)(n);
    if constexpr (kPacked<T>) {
      if (n > 0) sink.bytes(v.data(), n * sizeof(T));
    } else {
      for (const T& element : v) (*this)(element);
    }
  }
};

struct ByteSink {
  std::vector<std::byte>& out;
  void bytes(const void* p, size_t n) {
    const std::byte* b = static_cast<const std::byte*>(p);
    out.insert(out.end(), b, b + n);
  }
};

// Reads the output of Writer. Throws InputError, with `name` as the place, where the bytes end too early or are invalid.
struct Reader : Archive<Reader> {
  const std::vector<std::byte>& in;
  const char* name;
  size_t at = 0;
  Reader(const std::vector<std::byte>& from, const char* what) : in(from), name(what) {}

  void bytes(void* p, size_t n) {
    if (n > in.size() - at) throw InputError(name, "it ends too early", "the file was cut or belongs to another scene");
    std::memcpy(p, in.data() + at, n);
    at += n;
  }
  template <typename T>
  void operator()(T& v) {
    if constexpr (kPacked<T>) {
      bytes(&v, sizeof v);
    } else if constexpr (std::is_same_v<T, bool>) {  // a byte other than 0 or 1 is not a bool
      uint8_t byte = 0;
      bytes(&byte, 1);
      if (byte > 1) throw InputError(name, "a flag is neither on nor off", "the file is damaged");
      v = byte != 0;
    } else {
      visit(*this, v);
    }
  }
  template <typename T, typename Alloc>
  void operator()(std::vector<T, Alloc>& v) {
    uint64_t n = 0;
    (*this)(n);
    if constexpr (kPacked<T>) {
      if (n > (in.size() - at) / sizeof(T)) throw InputError(name, "an array has an impossible length", "the file is damaged");
      v.resize(n);
      if (n > 0) bytes(v.data(), n * sizeof(T));
    } else {
      if (n > in.size() - at) throw InputError(name, "an array has an impossible length", "the file is damaged");
      v.clear();  // grows with the bytes read: a damaged length cannot allocate more memory than the file fills
      for (uint64_t i = 0; i < n; ++i) (*this)(v.emplace_back());
    }
  }
};

}  // namespace catgut
