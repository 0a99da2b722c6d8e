# The front door. `make help` lists what there is; CMake does the work in build/release.
.DEFAULT_GOAL := help
.PHONY: help deps configure tools tee skirt trousers jacket waistcoat softtop softtop-coupled test validate bench docs asan ubsan clean
BUILD := build/release
JOBS ?= $(shell nproc)

help:
	@echo 'make tee      install what is missing, build, and make a T-shirt: pattern -> garment at rest on a dress form'
	@echo 'make skirt    the same for a skirt with darts'
	@echo 'make trousers the same for a pair of trousers, on a dress form with legs'
	@echo 'make jacket   a man'"'"'s jacket, shell and lined jacket put on a dress form, the shell buttoned and at rest'
	@echo 'make waistcoat   the same of a waistcoat'
	@echo 'make softtop  a convertible'"'"'s soft top, from the drawing of its frame to rest on the closed frame and open in a second'
	@echo 'make softtop-coupled   opens it once more, frame and cloth as two programs that talk: torque at the motor'
	@echo 'make test     build and run all tests'
	@echo 'make validate   the virtual laboratory: tests of textiles and shells against theory, report in build/validation'
	@echo 'make bench    time the tee stage by stage, cutting, sewing and layering of up to a million triangles, placement,'
	@echo '             and simulation beside Blender where that is installed'
	@echo 'make docs     write docs/stages/ from the programs'
	@echo 'make asan, make ubsan   the tests under AddressSanitizer or UndefinedBehaviorSanitizer'
	@echo 'make clean    remove build/'

deps:
	@scripts/install-deps.sh

configure: deps
	@test -f $(BUILD)/build.ninja || cmake --preset release

tools: configure
	@cmake --build $(BUILD) --target tools -j $(JOBS)

tee skirt trousers jacket waistcoat softtop: tools
	@$(BUILD)/bin/toile run pipelines/$@/pipeline.yaml --build build/garments -j $(JOBS)

softtop-coupled: softtop
	@pipelines/softtop/coupled.sh $(BUILD)/bin build/garments/softtop

test: configure
	@cmake --build $(BUILD) -j $(JOBS)
	@ctest --test-dir $(BUILD) --output-on-failure -j $(JOBS)

validate: tools
	@$(BUILD)/bin/toile-lab -o build/validation/report.json --page build/validation/validation.md --plots build/validation/plots \
	  --work build/validation/runs --jobs $(JOBS)

bench: deps
	@cmake --preset release -DTOILE_BENCH=ON
	@cmake --build $(BUILD) --target tools pipeline_bench tailoring_bench mechanics_bench placement_bench simulation_bench robustness_bench -j $(JOBS)
	@mkdir -p build/bench
	@$(BUILD)/bench/pipeline_bench $(BUILD)/bin pipelines/tee/pipeline.yaml build/bench build/bench/report.json
	@$(BUILD)/bench/tailoring_bench $(BUILD)/bin . build/bench/tailoring build/bench/report.json
	@$(BUILD)/bin/mechanics_bench . build/bench/report.json
	@$(BUILD)/bin/placement_bench . build/bench/report.json
	@$(BUILD)/bench/simulation_bench $(BUILD)/bin . build/bench/simulation build/bench/report.json
	@$(BUILD)/bench/robustness_bench $(BUILD)/bin . build/bench/robustness build/bench/report.json

docs: tools
	@scripts/generate-docs.sh $(BUILD)/bin docs/stages

asan ubsan: deps
	@cmake --preset $@
	@cmake --build build/$@ -j $(JOBS)
	@ctest --test-dir build/$@ --output-on-failure -j $(JOBS)

clean:
	rm -rf build
