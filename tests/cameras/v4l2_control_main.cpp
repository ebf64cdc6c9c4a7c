// Sets one control of a V4L2 device, whoever else has it open: wasp_v4l2_control NODE ID VALUE. For vivid's errors on
// demand, in the guest.
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const int fd = open(argv[1], O_RDWR | O_NONBLOCK);
  v4l2_ext_control control{};
  control.id = static_cast<__u32>(std::strtoul(argv[2], nullptr, 0));
  control.value = std::atoi(argv[3]);
  v4l2_ext_controls controls{};
  controls.which = V4L2_CTRL_WHICH_CUR_VAL;
  controls.count = 1;
  controls.controls = &control;
  if (fd >= 0 && ioctl(fd, VIDIOC_S_EXT_CTRLS, &controls) == 0) return 0;
  std::fprintf(stderr, "%s: control %s: %s\n", argv[1], argv[2], std::strerror(errno));
  return 1;
}
