// A plugin of qemu-user that counts the instructions of a program and writes how many there were at each of its marks.
//
//   qemu-aarch64 -plugin libinstruction_trace.so,out=FILE program
//
// A mark is the system call write(-7, tag, 0), which fails and does nothing else (instruction_mark.h). FILE gets one
// line per mark, "tag count", counted from the start of the program. Counts are of the guest's instructions, so they
// are the same in every run. Debian's qemu has no header for its plugins; what is used of its interface, version 1, is
// declared here (docs/devel/tcg-plugins.rst of qemu 7.2).
#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

typedef uint64_t qemu_plugin_id_t;
struct qemu_plugin_tb;
struct qemu_info;

typedef void (*translated_fn)(qemu_plugin_id_t, struct qemu_plugin_tb*);
typedef void (*syscall_fn)(qemu_plugin_id_t, unsigned vcpu, int64_t number, uint64_t a1, uint64_t a2, uint64_t a3,
                           uint64_t a4, uint64_t a5, uint64_t a6, uint64_t a7, uint64_t a8);
typedef void (*exit_fn)(qemu_plugin_id_t, void*);

enum { kInlineAdd = 0 };

extern void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t, translated_fn);
extern void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb*, int operation, void* counter, uint64_t by);
extern void qemu_plugin_register_vcpu_syscall_cb(qemu_plugin_id_t, syscall_fn);
extern void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, exit_fn, void*);
extern size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb*);

#define EXPORTED __attribute__((visibility("default")))
EXPORTED int qemu_plugin_version = 1;

enum { kSyscallWrite = 64, kMarkDescriptor = -7 };  // of aarch64 Linux; instruction_mark.h

static uint64_t instructions;
static FILE* out;

static void on_translated(qemu_plugin_id_t id, struct qemu_plugin_tb* block) {
  (void)id;
  qemu_plugin_register_vcpu_tb_exec_inline(block, kInlineAdd, &instructions, qemu_plugin_tb_n_insns(block));
}

static void on_syscall(qemu_plugin_id_t id, unsigned vcpu, int64_t number, uint64_t a1, uint64_t a2, uint64_t a3,
                       uint64_t a4, uint64_t a5, uint64_t a6, uint64_t a7, uint64_t a8) {
  (void)id, (void)vcpu, (void)a3, (void)a4, (void)a5, (void)a6, (void)a7, (void)a8;
  if (number == kSyscallWrite && (int32_t)a1 == kMarkDescriptor) {
    fprintf(out, "%" PRIu64 " %" PRIu64 "\n", a2, instructions);
  }
}

static void on_exit_(qemu_plugin_id_t id, void* unused) {
  (void)id, (void)unused;
  fclose(out);
}

EXPORTED int qemu_plugin_install(qemu_plugin_id_t id, const struct qemu_info* info, int argc, char** argv) {
  (void)info;
  for (int i = 0; i < argc; ++i) {
    if (strncmp(argv[i], "out=", 4) == 0) out = fopen(argv[i] + 4, "w");
  }
  if (out == NULL) {
    fprintf(stderr, "instruction_trace: expected out=FILE, a file that can be written\n");
    return -1;
  }
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_translated);
  qemu_plugin_register_vcpu_syscall_cb(id, on_syscall);
  qemu_plugin_register_atexit_cb(id, on_exit_, NULL);
  return 0;
}
