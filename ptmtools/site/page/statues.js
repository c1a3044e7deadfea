var u=class extends Error{constructor(e,t){super(t),this.code=e}};var S=()=>performance.now()/1e3;var y=(r="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${r}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,$=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,z=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
uniform float cutoff;
out vec4 shown;
${$}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=0.25+0.75*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
sampled=vec4(1.0);
}
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,k=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,V=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${k}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,H=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${k}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,U={surface:[y(),z],item:[y(),V],placeholder:[y(),H]};function I(r,e,t=U[e]){let o=r.createProgram(),s=[r.VERTEX_SHADER,r.FRAGMENT_SHADER];if(t.forEach((c,a)=>{let h=r.createShader(s[a]);r.shaderSource(h,c),r.compileShader(h),r.attachShader(o,h),r.deleteShader(h)}),r.linkProgram(o),!r.getProgramParameter(o,r.LINK_STATUS)&&!r.isContextLost())throw new Error(`${e}: ${r.getProgramInfoLog(o)}`);let i={},n=r.isContextLost()?0:r.getProgramParameter(o,r.ACTIVE_UNIFORMS);for(let c=0;c<n;c++){let a=r.getActiveUniform(o,c)?.name??"";i[a]=r.getUniformLocation(o,a)}return{program:o,at:i}}function D(r,{program:e,at:t},o){r.useProgram(e),r.uniform3fv(t.eye,o.eye),r.uniformMatrix3fv(t.turn,!1,o.turn),r.uniform4fv(t.lens,o.lens)}function _(r,e,t,o=0,s=o){let i=0;for(let n=0;n<3;n++){let c=Math.max(e[o+n]-r[n],r[n]-t[s+n],0);i+=c*c}return Math.sqrt(i)}function O(r){let e=-1;for(let t of r){e^=t;for(let o=0;o<8;o++)e=e&1?e>>>1^3988292384:e>>>1}return~e>>>0}var m=4096,F=2**24,B=7,G=65536,W=new Uint8Array([3,0]),L=2,j=4;function d(r,e){if(!r)throw new Error(e)}var R=(r,e,t)=>Number.isInteger(r)&&e<=r&&r<=t;function X({cube:r,levels:e,streams:t}){let o=s=>typeof s=="number"&&Math.abs(s)<=1e15;d(Array.isArray(r?.low)&&r.low.length===3&&r.low.every(o),"no cube"),d(o(r.side)&&r.side>=1e-15,"no cube"),d(Array.isArray(e)&&R(e.length,1,21),"no levels"),d(e.every(s=>R(s,1,F)),"a level without texels"),d(e.reduce((s,i)=>s+i,0)<=F,"too many texels");for(let s of t){for(let i of[s?.ends,s?.crc32])d(Array.isArray(i)&&i.length===e.length,"lists of other lengths"),d(i.every(n=>R(n,0,4294967295)),"a list without numbers");d(s.ends.every((i,n)=>i>(n?s.ends[n-1]:L)),"ends that do not ascend")}}var A=class{#e=0;constructor(e,t){this.gl=e;let o=Math.max(1,Math.ceil(t/m));this.bytes=new Uint8Array(4*m*o),this.texture=e.createTexture(),e.bindTexture(e.TEXTURE_2D,this.texture),e.texStorage2D(e.TEXTURE_2D,1,e.RGBA8UI,m,o);for(let s of[e.TEXTURE_MIN_FILTER,e.TEXTURE_MAG_FILTER])e.texParameteri(e.TEXTURE_2D,s,e.NEAREST)}upload(e){let{gl:t}=this,o=Math.ceil(e/m);t.bindTexture(t.TEXTURE_2D,this.texture),t.texSubImage2D(t.TEXTURE_2D,0,0,this.#e,m,o-this.#e,t.RGBA_INTEGER,t.UNSIGNED_BYTE,this.bytes,4*m*this.#e),this.#e=Math.floor(e/m)}},T=class{#e=[0,0];constructor(e,t,o,s,i){this.gl=e,this.index=t,this.urlOf=o,this.fetcher=s,this.step=i,this.starts=[0];for(let n of t.levels)this.starts.push((this.starts.at(-1)??0)+n);if(this.count=this.starts.at(-1),e.getParameter(e.MAX_TEXTURE_SIZE)<m)throw new u("PTM-V101","This graphics card has no textures of 4,096 texels.");this.streams=t.streams,this.texels=this.streams.map(()=>new A(e,this.count)),this.levels=0,this.partial=!1,this.updates=0,this.running=!1}get complete(){return this.levels===this.index.levels.length}delete(){for(let{texture:e}of this.texels)this.gl.deleteTexture(e)}get bytes(){return this.texels.reduce((e,{bytes:t})=>e+t.length,0)}get fetched(){return this.levels?this.streams.reduce((e,{ends:t})=>e+t[this.levels-1],0):0}advance(e,t,o){this.running||this.complete||!e(this.levels)||(this.running=!0,this.#t().then(()=>{this.running=!1,o?.()},t))}async#t(){let e=this.index.levels.length,t=this.levels?this.levels+1:Math.min(B,e);this.#e=[0,0];let o=this.step&&this.levels?setInterval(()=>this.#o(),1e3*this.step):0;try{await Promise.all(this.streams.map((s,i)=>this.#s(s,i,this.levels,t)))}finally{clearInterval(o)}for(let s of this.texels)s.upload(this.starts[t]);this.updates++,this.levels=t,this.partial=!1}#o(){let e=Math.min(...this.#e.slice(0,this.streams.length));if(!(e<=this.starts[this.levels])){for(let t of this.texels)t.upload(e);this.updates++,this.partial=!0}}async#s(e,t,o,s){let i=e.ends.at(-1),n=o?e.ends[o-1]:L,c=e.ends[s-1]-(s===e.ends.length?j:0),a=this.urlOf(e.file),{bytes:h}=this.texels[t],f=async p=>{let x=new DecompressionStream("deflate-raw"),E=x.writable.getWriter(),g=4*this.starts[o],b=(async()=>{for(let l=x.readable.getReader();;){let{done:v,value:w}=await l.read();if(v)return;d(g+w.length<=4*this.starts[s],"more texels than the index says"),h.set(w,g),g+=w.length,this.#e[t]=Math.floor(g/4)}})();b.catch(()=>{});let M=this.step&&o?G:c-n;for(let l=n;l<c;l+=M){let v=await this.fetcher.range(a,l,Math.min(l+M,c),i,void 0,p),w=l-v.begin,q=v.body.subarray(w,w+Math.min(M,c-l));await Promise.race([E.write(q),b])}s<e.ends.length&&await Promise.race([E.write(W),b]),await Promise.all([E.close(),b]),d(g===4*this.starts[s],"fewer texels than the index says");for(let l=o;l<s;l++){let v=h.subarray(4*this.starts[l],4*this.starts[l+1]);d(O(v)===e.crc32[l],`level ${l} has another checksum`)}};try{await f("default")}catch(p){if(p instanceof u)throw p;await f("no-store").catch(x=>{throw x instanceof u?x:new u("PTM-V105",`${e.file} is damaged: ${x.message}`)})}}};var N=`
uniform usampler2D octree;
uniform int texels,deepest;
uniform bool partial;
uvec4 texel(usampler2D of,int address){
return texelFetch(of,ivec2(address % ${m},address/${m}),0);
}
int ones(uint mask){
mask-=mask >> 1u & 0x55u;
mask=(mask & 0x33u)+(mask >> 2u & 0x33u);
return int((mask+(mask >> 4u))& 0x0fu);
}
int addressAt(vec3 at,int stop){
at=clamp(at,0.0,0.99999994);
int address=0;
uvec4 here=texel(octree,0);
stop=min(stop,deepest+int(partial));
for(int depth=0; here.a !=0u && depth < stop && address+1 < texels; depth++){
at*=2.0;
bvec3 upper=greaterThanEqual(at,vec3(1.0));
at-=vec3(upper);
uint bit=1u <<(uint(upper.x)+2u*uint(upper.y)+4u*uint(upper.z));
if((here.a & bit)==0u)break;
uvec4 below=texel(octree,address+1);
int next=int(below.r | below.g << 8u | below.b << 16u);
next+=ones(here.a &(bit-1u))+ones(below.a &(bit-1u));
if(next >=texels)break;
uvec4 there=texel(octree,next);
if(partial && depth==deepest && there.rgb==uvec3(0u))break;
address=next;
here=there;
}
return address;
}
int stopDepth(vec3 at){
vec3 dx=dFdx(at),dy=dFdy(at);
return-((floatBitsToInt(min(dot(dx,dx),dot(dy,dy)))>> 23)-127 >> 1);
}`;var K=128<<20,C=.3,Y=[.5,.7,.6].map(r=>r/Math.hypot(.5,.7,.6)),Z=.1,J=y(`
uniform vec3 low;
uniform float side;
out vec3 q;`,"q = (position - low) / side;"),Q=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec3 q;
uniform float cutoff;
out vec4 shown;
${$}
${N}
void main(){
int stop=stopDepth(q);
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(vec3(texel(octree,addressAt(q,stop)).rgb)/127.5-1.0);
float along=(1.0+dot(normal,vec3(${Y.join()})))/2.0;
float light=${C}+${1-C}*along*along;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,P=class{#e=[];#t=new Map;#o=!1;#s=[];constructor(e,t,o,s,i,n){this.gl=e,this.rows=t,this.site=o,this.fetcher=s,this.report=i,this.touch=n,this.program=I(e,"octree",[J,Q])}has(e){return(this.#e[e]?.levels??0)>0}get lacks(){return!this.#o||[...this.#t.keys()].some(e=>this.#n(e))}get levels(){return this.#e.map(e=>e?.levels??0)}get bytes(){return this.#e.reduce((e,t)=>e+(t?.bytes??0),0)}advance(e,t,o){this.#t.clear(),this.#o=!0;let s=S();for(let{batches:c}of e)for(let{look:{octree:a},low:h,high:f}of c){if(!this.rows[a]||this.#e[a]===null)continue;let p=Math.max(Z,_(t,h,f)),x=o/2/p*this.rows[a].cube.side;this.#t.set(a,Math.max(x,this.#t.get(a)??0)),this.#s[a]=s}if(this.#e.some(c=>c?.running))return;let i=-1,n=0;for(let c of this.#t.keys()){let a=this.#r(c);a>n&&this.#n(c)&&([i,n]=[c,a])}i>=0&&this.#i(i)}#r(e){let t=this.#e[e]?.levels??0;return(this.#t.get(e)??0)*2**-Math.max(0,t-1)}#n(e){let t=this.#e[e];return t!==null&&!t?.complete&&this.#r(e)>1}#i(e){let{cube:t,levels:o,file:s,ends:i,crc32:n}=this.rows[e],c=a=>{this.#e[e]?.delete(),this.#e[e]=null,this.touch();let h=`${s} is damaged: ${a.message}`;this.report(a instanceof u?a:new u("PTM-V105",h))};try{let a=this.#e[e];if(!a){let h={cube:t,levels:o,streams:[{file:s,ends:i,crc32:n}]};X(h),this.#a(4*o.reduce((f,p)=>f+p,0)),a=new T(this.gl,h,f=>this.site.of(f),this.fetcher,0),this.#e[e]=a}a.advance(()=>!0,c,this.touch)}catch(a){c(a)}}#a(e){let t=[...this.#e.keys()].filter(o=>this.#e[o]&&!this.#t.has(o));for(let o of t.sort((s,i)=>this.#s[s]-this.#s[i])){if(this.bytes+e<=K)return;this.#e[o]?.delete(),delete this.#e[o]}}draw(e,t,o){let{gl:s,program:i}=this,{at:n}=i;D(s,i,e),s.uniform1i(n.octree,1);let c=!1;for(let{buffers:a,batch:h}of t){let f=this.#e[h.look.octree],{cube:{low:p,side:x}}=f.index;s.activeTexture(s.TEXTURE1),s.bindTexture(s.TEXTURE_2D,f.texels[0].texture),s.activeTexture(s.TEXTURE0),s.uniform3fv(n.low,p),s.uniform1f(n.side,x),s.uniform1i(n.texels,f.count),s.uniform1i(n.deepest,f.levels-1),s.uniform1i(n.partial,0),s.bindVertexArray(a.vertexArray),c=o(n,h)||c,a.draw(h)}return c}};export{P as Statues};
