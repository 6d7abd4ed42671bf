// SPDX-License-Identifier: Apache-2.0
// exchange: the picture of a divided tissue, in a Snapshot. It is derived where it is first looked at, once, on the thread that
// looks: a tick does not wait for it. Copies of a Snapshot share it.
#pragma once
#include <functional>
#include <memory>

namespace catgut {

struct PictureModel;

class DividedPicture {
 public:
  DividedPicture() = default;  // as built
  explicit DividedPicture(std::shared_ptr<const PictureModel> made) : made_(std::move(made)) {}
  explicit DividedPicture(std::function<PictureModel()> make);  // must not refer to a state that changes

  explicit operator bool() const { return made_ || later_; }
  const PictureModel& operator*() const;
  const PictureModel* operator->() const { return &**this; }
  bool operator==(const DividedPicture&) const = default;  // the same picture, not an equal one

 private:
  struct Later;
  std::shared_ptr<const PictureModel> made_;
  std::shared_ptr<Later> later_;
};

}  // namespace catgut
