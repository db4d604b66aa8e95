#pragma once
// Between the tick task and the nav job: every InputFrame one way, one answer per image the other way.

#include "fsw/app/nav_result.h"
#include "fsw/app/sensor_rings.h"
#include "fsw/params/param_store.h"

namespace plumb {

struct NavOrder {
  InputFrame input;
  bool has_image = false;  ///< an image to be processed; input.has_camera alone may be one that is skipped
  StoredImage image;
};

struct NavAnswer {
  bool has_state = false;  ///< false: the image was refused
  std::uint8_t slot = 0;   ///< of the image, free again
  NavResult result;
  ParamDamage damage = ParamDamage::kNone;  ///< of the nav job's parameters, found since the last answer
  Time t_start;                             ///< physical time that the job took, for the account of the schedule
  Time t_end;
};

struct NavLink {
  SpscRing<NavOrder, 128> orders;  ///< half a second that the nav job may be behind
  SpscRing<NavAnswer, 4> answers;  ///< one image is out at a time
};

}  // namespace plumb
