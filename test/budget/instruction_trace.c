// A plugin of qemu-user that counts the instructions of a program and writes how many there were at each of its marks.
//
//   qemu-aarch64 -plugin libinstruction_trace.so,out=FILE[,functions=FILE] program
//
// A mark is the system call write(-7, tag, 0), which fails and does nothing else (instruction_mark.h). `out` gets one
// line per mark, "tag count", counted from the start of the program. `functions` gets one line per function and region,
// "region count symbol", of the innermost region that is open, from the first mark on; what is not in the program's own
// symbol table has no name. Counts are of the guest's instructions, so they are the same in every run. Debian's qemu has
// no header for its plugins; what is used of its interface, version 1, is declared here (docs/devel/tcg-plugins.rst of
// qemu 7.2).
#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

typedef uint64_t qemu_plugin_id_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
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
extern struct qemu_plugin_insn* qemu_plugin_tb_get_insn(const struct qemu_plugin_tb*, size_t);
extern const char* qemu_plugin_insn_symbol(const struct qemu_plugin_insn*);

#define EXPORTED __attribute__((visibility("default")))
EXPORTED int qemu_plugin_version = 1;

enum { kWriteOnArm = 64, kWriteOnX86 = 1, kMarkDescriptor = -7 };  // of 64-bit Linux; instruction_mark.h
enum { kRegions = 32, kMaxDepth = 8, kMaxFunctions = 4096 };

static uint64_t instructions;
static FILE* out;

// Function 0 is all that has no name or no place.
static FILE* functions_out;
static const char* names[kMaxFunctions] = {"?"};
static size_t functions = 1;
static uint64_t counts[kMaxFunctions];
static uint64_t counted[kMaxFunctions];  // up to the last mark
static uint64_t by_region[kRegions][kMaxFunctions];
static unsigned open_regions[kMaxDepth];
static size_t depth;

static size_t function_of(const struct qemu_plugin_tb* block) {
  const char* name = qemu_plugin_insn_symbol(qemu_plugin_tb_get_insn(block, 0));
  if (name == NULL) return 0;
  for (size_t i = 1; i < functions; ++i) {
    if (strcmp(names[i], name) == 0) return i;
  }
  if (functions == kMaxFunctions) return 0;
  names[functions] = name;
  return functions++;
}

static void on_translated(qemu_plugin_id_t id, struct qemu_plugin_tb* block) {
  (void)id;
  const size_t size = qemu_plugin_tb_n_insns(block);
  qemu_plugin_register_vcpu_tb_exec_inline(block, kInlineAdd, &instructions, size);
  if (functions_out == NULL) return;
  qemu_plugin_register_vcpu_tb_exec_inline(block, kInlineAdd, &counts[function_of(block)], size);
}

// What ran since the last mark belongs to the region that was open.
static void share_out(unsigned tag) {
  for (size_t i = 0; i < functions; ++i) {
    if (depth > 0) by_region[open_regions[depth - 1]][i] += counts[i] - counted[i];
    counted[i] = counts[i];
  }
  const unsigned region = tag / 2 % kRegions;
  if (region == kRegions - 1) return;  // the end of an image, which nothing begins
  if (tag % 2 == 0 && depth < kMaxDepth) open_regions[depth++] = region;
  if (tag % 2 == 1 && depth > 0) --depth;
}

static void on_syscall(qemu_plugin_id_t id, unsigned vcpu, int64_t number, uint64_t a1, uint64_t a2, uint64_t a3,
                       uint64_t a4, uint64_t a5, uint64_t a6, uint64_t a7, uint64_t a8) {
  (void)id, (void)vcpu, (void)a3, (void)a4, (void)a5, (void)a6, (void)a7, (void)a8;
  if ((number == kWriteOnArm || number == kWriteOnX86) && (int32_t)a1 == kMarkDescriptor) {
    fprintf(out, "%" PRIu64 " %" PRIu64 "\n", a2, instructions);
    if (functions_out != NULL) share_out((unsigned)a2);
  }
}

static void on_exit_(qemu_plugin_id_t id, void* unused) {
  (void)id, (void)unused;
  fclose(out);
  if (functions_out == NULL) return;
  for (unsigned region = 0; region < kRegions; ++region) {
    for (size_t i = 0; i < functions; ++i) {
      if (by_region[region][i] == 0) continue;
      fprintf(functions_out, "%u %" PRIu64 " %s\n", region, by_region[region][i], names[i]);
    }
  }
  fclose(functions_out);
}

EXPORTED int qemu_plugin_install(qemu_plugin_id_t id, const struct qemu_info* info, int argc, char** argv) {
  (void)info;
  for (int i = 0; i < argc; ++i) {
    if (strncmp(argv[i], "out=", 4) == 0) out = fopen(argv[i] + 4, "w");
    if (strncmp(argv[i], "functions=", 10) == 0) functions_out = fopen(argv[i] + 10, "w");
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
