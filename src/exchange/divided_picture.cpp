// SPDX-License-Identifier: Apache-2.0
// exchange/divided_picture: see the header.
#include "exchange/divided_picture.h"

#include <mutex>
#include <utility>

#include "exchange/picture.h"

namespace catgut {

struct DividedPicture::Later {
  std::once_flag once;
  std::function<PictureModel()> make;
  PictureModel picture;
};

DividedPicture::DividedPicture(std::function<PictureModel()> make) : later_(std::make_shared<Later>()) {
  later_->make = std::move(make);
}

const PictureModel& DividedPicture::operator*() const {
  if (made_) return *made_;
  std::call_once(later_->once, [this] {
    later_->picture = later_->make();
    later_->make = nullptr;  // frees the captured source data
  });
  return later_->picture;
}

}  // namespace catgut
