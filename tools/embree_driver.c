/* Serves Embree 4 to compare_embree.py: reads an exported scene, then casts all its rays once for each line read.
 *
 * driver LIBRARY FOLDER WAYS; a line names a way: flat1, flat16, inst1, inst16. Answers the CPU seconds, and writes
 * embree_ranges.f32. The library is opened at run time, and its few declarations are written out here, so that no
 * Embree headers are needed. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef void *Handle;
typedef struct __attribute__((aligned(16))) {
  float org[3], tnear, dir[3], time, tfar;
  uint32_t mask, id, flags;
  float ng[3], u, v;
  uint32_t prim, geom, inst, inst_prim;
} Ray1;
typedef struct __attribute__((aligned(64))) {
  float org[3][16], tnear[16], dir[3][16], time[16], tfar[16];
  uint32_t mask[16], id[16], flags[16];
  float ng[3][16], u[16], v[16];
  uint32_t prim[16], geom[16], inst[16], inst_prim[16];
} Ray16;
typedef struct {
  uint32_t flags, features;
  void *context, *filter, *intersect;
  float width;
  uint32_t room[15];
} Arguments;

static Handle (*new_device)(const char *), (*new_scene)(Handle), (*new_geometry)(Handle, int);
static void *(*new_buffer)(Handle, int, unsigned, int, size_t, size_t);
static void (*commit_geometry)(Handle), (*commit_scene)(Handle), (*set_instanced)(Handle, Handle);
static unsigned (*attach)(Handle, Handle);
static void (*set_transform)(Handle, unsigned, int, const void *);
static void (*intersect1)(Handle, Ray1 *, Arguments *);
static void (*intersect16)(const int *, Handle, Ray16 *, Arguments *);
static Handle device;
static const char *folder;

static void *load(const char *name, size_t *bytes) {
  char path[4096];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = fopen(path, "rb");
  if (!file) return NULL;
  fseek(file, 0, SEEK_END);
  *bytes = (size_t)ftell(file);
  rewind(file);
  void *all = malloc(*bytes ? *bytes : 1);
  if (fread(all, 1, *bytes, file) != *bytes) exit(3);
  fclose(file);
  return all;
}

typedef struct {
  float *vertices;
  uint32_t *triangles;
  size_t vertex_count, triangle_count;
} Mesh;

static int mesh(const char *name, Mesh *out) {
  char path[256];
  size_t bytes;
  snprintf(path, sizeof path, "%s_vertices.f32", name);
  if (!(out->vertices = load(path, &bytes))) return 0;
  out->vertex_count = bytes / 12;
  snprintf(path, sizeof path, "%s_triangles.u32", name);
  if (!(out->triangles = load(path, &bytes))) return 0;
  out->triangle_count = bytes / 12;
  return 1;
}

/* map: 3 x 4 row by row, or NULL */
static void add(Handle scene, const Mesh *mesh, const float *map) {
  Handle geometry = new_geometry(device, 0);
  float *to = new_buffer(geometry, 1, 0, 0x9003, 12, mesh->vertex_count);
  for (size_t i = 0; i < mesh->vertex_count; i++)
    for (int r = 0; r < 3; r++) {
      const float *p = mesh->vertices + 3 * i;
      to[3 * i + r] = map ? (float)((double)map[4 * r] * p[0] + (double)map[4 * r + 1] * p[1] +
                                    (double)map[4 * r + 2] * p[2] + map[4 * r + 3])
                          : p[r];
    }
  memcpy(new_buffer(geometry, 0, 0, 0x5003, 12, mesh->triangle_count), mesh->triangles, mesh->triangle_count * 12);
  commit_geometry(geometry);
  attach(scene, geometry);
}

int main(int count, char **words) {
  if (count != 4) return 2;
  folder = words[2];
  void *library = dlopen(words[1], RTLD_NOW);
  if (!library) {
    fprintf(stderr, "%s\n", dlerror());
    return 3;
  }
#define GET(name, symbol) *(void **)&name = dlsym(library, symbol)
  GET(new_device, "rtcNewDevice");
  GET(new_scene, "rtcNewScene");
  GET(new_geometry, "rtcNewGeometry");
  GET(new_buffer, "rtcSetNewGeometryBuffer");
  GET(commit_geometry, "rtcCommitGeometry");
  GET(commit_scene, "rtcCommitScene");
  GET(set_instanced, "rtcSetGeometryInstancedScene");
  GET(attach, "rtcAttachGeometry");
  GET(set_transform, "rtcSetGeometryTransform");
  GET(intersect1, "rtcIntersect1");
  GET(intersect16, "rtcIntersect16");
  device = new_device("threads=1");

  size_t bytes;
  uint32_t *kind = load("plant_prototype.u32", &bytes);
  size_t plants = bytes / 4;
  float *maps = load("plant_world_from_plant.f32", &bytes);
  float *rays = load("rays.f32", &bytes);
  size_t n = bytes / 28;
  float *ranges = malloc(n * 4);
  Mesh soil, prototypes[4096];
  size_t kinds = 0;
  char name[64];
  if (!mesh("soil", &soil)) return 3;
  for (; kinds < 4096; kinds++) {
    snprintf(name, sizeof name, "prototype%zu", kinds);
    if (!mesh(name, &prototypes[kinds])) break;
  }

  Handle flat = NULL, top = NULL;
  if (strstr(words[3], "flat")) {
    flat = new_scene(device);
    add(flat, &soil, NULL);
    for (size_t i = 0; i < plants; i++) add(flat, &prototypes[kind[i]], maps + 12 * i);
    commit_scene(flat);
  }
  if (strstr(words[3], "inst")) {
    Handle *grown = malloc(kinds * sizeof *grown);
    for (size_t k = 0; k < kinds; k++) {
      grown[k] = new_scene(device);
      add(grown[k], &prototypes[k], NULL);
      commit_scene(grown[k]);
    }
    top = new_scene(device);
    add(top, &soil, NULL);
    for (size_t i = 0; i < plants; i++) {
      Handle instance = new_geometry(device, 121);
      set_instanced(instance, grown[kind[i]]);
      set_transform(instance, 0, 0x9134, maps + 12 * i);
      commit_geometry(instance);
      attach(top, instance);
    }
    commit_scene(top);
  }

  size_t packets = (n + 15) / 16;
  Ray16 *wide = aligned_alloc(64, packets * sizeof *wide);
  memset(wide, 0, packets * sizeof *wide);
  for (size_t i = 0; i < packets * 16; i++) {
    const float *ray = rays + 7 * (i < n ? i : n - 1);
    Ray16 *to = wide + i / 16;
    for (int a = 0; a < 3; a++) to->org[a][i % 16] = ray[a], to->dir[a][i % 16] = ray[3 + a];
    to->tfar[i % 16] = ray[6];
    to->mask[i % 16] = ~0u;
    to->geom[i % 16] = to->inst[i % 16] = ~0u;
  }
  static const int valid[16] __attribute__((aligned(64))) = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
  printf("ready %zu\n", n);
  fflush(stdout);
  char line[64];
  while (fgets(line, sizeof line, stdin)) {
    Handle scene = strncmp(line, "flat", 4) ? top : flat;
    int packet = strstr(line, "16") != NULL;
    Arguments how = {.flags = packet ? 1u << 16 : 0, .features = ~0u};
    struct timespec begin, end;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
    if (packet) {
      Ray16 now;
      for (size_t p = 0; p < packets; p++) {
        now = wide[p];
        intersect16(valid, scene, &now, &how);
        for (int i = 0; i < 16 && p * 16 + i < n; i++) ranges[p * 16 + i] = now.geom[i] == ~0u ? INFINITY : now.tfar[i];
      }
    } else {
      for (size_t i = 0; i < n; i++) {
        const float *ray = rays + 7 * i;
        Ray1 now = {.org = {ray[0], ray[1], ray[2]}, .dir = {ray[3], ray[4], ray[5]}, .tfar = ray[6], .mask = ~0u};
        now.geom = now.inst = ~0u;
        intersect1(scene, &now, &how);
        ranges[i] = now.geom == ~0u ? INFINITY : now.tfar;
      }
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
    char path[4096];
    snprintf(path, sizeof path, "%s/embree_ranges.f32", folder);
    FILE *file = fopen(path, "wb");
    fwrite(ranges, 4, n, file);
    fclose(file);
    printf("%.6f\n", (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec));
    fflush(stdout);
  }
  return 0;
}
